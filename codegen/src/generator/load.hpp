// generator - finds robot files and effect records, and makes a model of them.
#pragma once

#include <filesystem>
#include <string>

#include "codegen/src/generator/model.hpp"

namespace armcal::codegen {

// The folder that holds codegen/ (the checkout), found from ARMCAL_HOME, the current folder or the executable's place.
// InputError: none of them.
std::filesystem::path Home();

// A robot file's path, or a name in codegen/robots. InputError names the robots there are.
std::filesystem::path RobotPath(const std::string& name_or_path);

Catalogue LoadCatalogue();
Model LoadModel(const std::string& robot);

}  // namespace armcal::codegen
