// tests - the pictures of docs: what each file must hold.
#pragma once

#include <map>
#include <string>

namespace armcal::tests {

using Pictures = std::map<std::string, std::string>;  // file below docs -> its bytes

Pictures EffectPictures();   // effects/NAME.svg for each record of the catalogue
Pictures ConceptPictures();  // what docs/concepts.md shows

}  // namespace armcal::tests
