# conan - the library as a package of Conan 2: `conan create toolchains/conan`. Its targets are those of find_package(armcal).
import os
import re

from conan import ConanFile
from conan.tools.cmake import CMake, CMakeToolchain, cmake_layout
from conan.tools.files import copy, load

TOP = ["CMakeLists.txt", "LICENSE", "*.md", "package.xml"]
FOLDERS = ["lib", "codegen/robots", "codegen/effects", "codegen/generated", "port", "host_sim/scenarios", "toolchains", "docs"]  # what toolchains/install.cmake reads


class Armcal(ConanFile):
    name = "armcal"
    description = "Estimates the dynamic parameters of robot arms: a library for firmware, and its models"
    license = "MIT"
    settings = "os", "compiler", "build_type", "arch"
    package_type = "header-library"  # its sources are compiled by the target that links armcal::lib

    def checkout(self):
        return os.path.join(self.recipe_folder, "..", "..")

    def set_version(self):
        text = load(self, os.path.join(self.checkout(), "lib", "armcal", "core", "version.hpp"))
        digits = re.search(r"#define ARMCAL_VERSION 0x(..)(..)(..)", text).groups()
        self.version = ".".join(str(int(d, 16)) for d in digits)

    def export_sources(self):
        for pattern in TOP:
            copy(self, pattern, self.checkout(), self.export_sources_folder, excludes="*/*")
        for folder in FOLDERS:
            copy(self, f"{folder}/*", self.checkout(), self.export_sources_folder)

    def layout(self):
        cmake_layout(self)

    def generate(self):
        toolchain = CMakeToolchain(self)
        toolchain.cache_variables["ARMCAL_LIBRARY_ONLY"] = True
        toolchain.generate()

    def package(self):
        cmake = CMake(self)
        cmake.configure()
        cmake.install()

    def package_id(self):
        self.info.clear()  # one package serves all machines

    def package_info(self):
        self.cpp_info.set_property("cmake_find_mode", "none")  # the package brings its own armcalConfig.cmake
        self.cpp_info.builddirs = [os.path.join("share", "armcal", "cmake")]
        self.cpp_info.bindirs = self.cpp_info.includedirs = self.cpp_info.libdirs = []
