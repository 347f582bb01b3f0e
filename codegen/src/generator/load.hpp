// generator - finds robot files and effect records, and makes a model of them.
#pragma once

#include <filesystem>
#include <string>

#include "codegen/src/generator/model.hpp"

namespace armcal::codegen {

// The folder that holds codegen/ (checkout, or share/armcal of an installation), found from ARMCAL_HOME, the current
// folder or the executable's place. InputError: none of them, and no folder was set.
std::filesystem::path Home();

// Where to look last: a program that is installed beside its own copy of robots and effects says so once, at its start.
void SetInstalledHome(const std::filesystem::path& folder);

// A file's path, or a name of a TOML file in `folder`. InputError says `what` was looked for, and names those there
// are.
std::filesystem::path NamedFile(const std::string& what, const std::string& name_or_path,
                                const std::filesystem::path& folder);

// A robot file's path, or a name in codegen/robots. InputError names the robots there are.
std::filesystem::path RobotPath(const std::string& name_or_path);

Catalogue LoadCatalogue();
Model LoadModel(const std::string& robot);

}  // namespace armcal::codegen
