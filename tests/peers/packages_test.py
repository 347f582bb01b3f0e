# peers - armcal as a package of other people's tools: Conan and colcon build it, PlatformIO and Kconfig read its manifests.
#
#   packages_test.py CHECKOUT FOLDER
import json
import os
import pathlib
import shutil
import subprocess
import sys
import tarfile

import kconfiglib
import yaml
from platformio.package.manifest.parser import ManifestParserFactory
from platformio.package.manifest.schema import ManifestSchema
from platformio.package.pack import PackagePacker

CHECKOUT, FOLDER = pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2]).resolve()
BESIDE = pathlib.Path(__file__).resolve().parent
CONSUMER = BESIDE.parent / "add_model" / "consumer"


def run(words, **more):
    done = subprocess.run([str(w) for w in words], text=True, capture_output=True, **more)
    if done.returncode != 0:
        sys.exit(f"{' '.join(map(str, words))}: exit {done.returncode}\n{done.stdout[-3000:]}{done.stderr[-3000:]}")
    return done.stdout


def platformio():
    # PlatformIO reads the list of licences from the network; MIT is on it.
    ManifestSchema.load_spdx_licenses = staticmethod(lambda: {"licenses": [{"licenseId": "MIT"}]})
    manifest = ManifestSchema().load_manifest(ManifestParserFactory.new_from_file(str(CHECKOUT / "library.json")).as_dict())
    build = json.loads((CHECKOUT / "library.json").read_text())["build"]
    for header in manifest["headers"]:
        assert (CHECKOUT / build["includeDir"] / header).is_file(), header
    packed = FOLDER / "armcal.tar.gz"
    PackagePacker(str(CHECKOUT)).pack(str(packed))
    with tarfile.open(packed) as archive:
        names = set(archive.getnames())
        archive.extractall(FOLDER / "platformio")
    for name in ["library.json", "LICENSE", "lib/armcal/armcal.hpp", "lib/armcal/link/rtu.cpp", "codegen/generated/er20_like/model.hpp"]:
        assert name in names, name
    assert not any(name.startswith(("host_sim", "tests", "build")) for name in names)
    # PlatformIO would compile every source below srcDir with these flags.
    for source in sorted((FOLDER / "platformio" / build["srcDir"]).rglob("*.cpp")):
        run(["g++", "-std=c++17", "-fsyntax-only", "-I", FOLDER / "platformio" / build["includeDir"], *build["flags"], source])
    print(f"PlatformIO: manifest valid, {len(names)} entries packed, sources compile")


def zephyr():
    module = yaml.safe_load((CHECKOUT / "zephyr" / "module.yml").read_text())
    assert set(module) == {"name", "build"} and module["name"] == "armcal", module
    assert set(module["build"]) == {"cmake", "kconfig"}, module
    assert (CHECKOUT / module["build"]["cmake"] / "CMakeLists.txt").is_file()
    # Three symbols of Zephyr, as an application for a core with an FPU sets them.
    top = FOLDER / "Kconfig"
    top.write_text(
        'config CPP\n\tbool "C++"\nconfig FPU\n\tbool "FPU"\nconfig REQUIRES_FULL_LIBCPP\n\tbool\n'
        f'source "{CHECKOUT / module["build"]["kconfig"]}"\n'
    )
    kconfig = kconfiglib.Kconfig(str(top), warn_to_stderr=False)
    assert not kconfig.warnings, kconfig.warnings
    armcal = kconfig.syms["ARMCAL"]
    armcal.set_value("y")
    assert armcal.str_value == "n"  # without an FPU
    kconfig.syms["CPP"].set_value("y")
    kconfig.syms["FPU"].set_value("y")
    assert armcal.str_value == "y" and kconfig.syms["REQUIRES_FULL_LIBCPP"].str_value == "y"
    # What Zephyr's build does with a module: its folder is added, and the application `app` is a library.
    project = FOLDER / "zephyr"
    project.mkdir()
    (project / "main.cpp").write_text("#include <armcal/armcal.hpp>\n#include <model.hpp>\nint joints() { return armcal::generated::Er20Like::kJoints; }\n")
    (project / "CMakeLists.txt").write_text(
        "cmake_minimum_required(VERSION 3.25)\nproject(application LANGUAGES CXX)\nset(CONFIG_ARMCAL y)\n"
        f"add_subdirectory({CHECKOUT / module['build']['cmake']} armcal)\n"
        "add_library(app STATIC main.cpp)\ntarget_link_libraries(app PRIVATE armcal::lib armcal::model_er20_like)\n"
    )
    run(["cmake", "-S", project, "-B", project / "build", "-G", "Ninja", "-DCMAKE_UNITY_BUILD=ON"])
    run(["cmake", "--build", project / "build"])
    print("Zephyr: module.yml and Kconfig read, the module's CMake file gives the targets")


def conan():
    environment = dict(os.environ, CONAN_HOME=str(FOLDER / "conan"))
    tool = pathlib.Path(sys.executable).parent / "conan"
    run([tool, "profile", "detect"], env=environment)
    out = run(
        [tool, "create", CHECKOUT / "toolchains" / "conan", "-c", "tools.cmake.cmaketoolchain:generator=Ninja",
         "-c", f"tools.cmake.cmake_layout:test_folder={FOLDER / 'conan_test'}", "--format=json"],
        env=environment,
    )
    version = [n["ref"].split("#")[0] for n in json.loads(out)["graph"]["nodes"].values() if n.get("name") == "armcal"]
    print(f"Conan: {version[0]} created, its test package ran")


def colcon():
    space = FOLDER / "workspace"
    (space / "src").mkdir(parents=True)
    (space / "src" / "armcal").symlink_to(CHECKOUT)
    shutil.copytree(CONSUMER, space / "src" / "consumer")
    (space / "src" / "consumer" / "package.xml").write_text(
        (CHECKOUT / "package.xml").read_text().replace("<name>armcal</name>", "<name>consumer</name>")
        .replace(' file="LICENSE"', "").replace("<export>", "<depend>armcal</depend>\n  <export>")
    )
    run(["/usr/bin/python3", "-c", "import sys; from catkin_pkg.package import parse_package; parse_package(sys.argv[1])", CHECKOUT])
    run(
        ["colcon", "build", "--executor", "sequential", "--cmake-args", "-G", "Ninja", "-DARMCAL_LIBRARY_ONLY=ON",
         "-DCMAKE_UNITY_BUILD=ON", "-DWAY=package", f"-DARMCAL_GENERATE={CHECKOUT}/build/host/armcal-generate"],
        cwd=space,
    )
    run([space / "build" / "consumer" / "consumer"])
    assert (space / "install" / "armcal" / "share" / "armcal" / "package.xml").is_file()
    print("colcon: armcal and a package that depends on it are built; the latter ran")


shutil.rmtree(FOLDER, ignore_errors=True)
FOLDER.mkdir(parents=True)
platformio()
zephyr()
conan()
colcon()
