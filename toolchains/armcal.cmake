# Language level, warnings and floating-point rules of every target; one place.
option(ARMCAL_SANITIZE "address and undefined-behaviour sanitizers (host)" OFF)
# The presets set it. A user who builds the generator or the Python package may have a compiler that warns of something else.
option(ARMCAL_WARNINGS_ARE_ERRORS "a warning ends the build" OFF)

set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)

add_library(armcal_rules INTERFACE)
set(armcal_warnings -Wall -Wextra -Wpedantic $<$<BOOL:${ARMCAL_WARNINGS_ARE_ERRORS}>:-Werror> -Wshadow)
# Contraction would make host and target differ in the last bit; fast-math would remove the NaN checks.
target_compile_options(armcal_rules INTERFACE ${armcal_warnings} -ffp-contract=off -fno-fast-math -fno-math-errno)
get_filename_component(ARMCAL_TOP ${CMAKE_CURRENT_LIST_DIR} DIRECTORY)  # the checkout
target_include_directories(armcal_rules INTERFACE ${ARMCAL_TOP}/lib)
if(CMAKE_CROSSCOMPILING)
  target_compile_options(armcal_rules INTERFACE -fcallgraph-info=su)  # who calls whom and with how much stack: toolchains/stack.py
endif()

# What every room of lib asks of the code that includes it: on the target a double is an accident.
add_library(armcal_lib_rules INTERFACE)
target_link_libraries(armcal_lib_rules INTERFACE armcal_rules)
target_compile_options(armcal_lib_rules INTERFACE -Wconversion -Wno-sign-conversion -Wdouble-promotion)

# Host-side code computes in double. g++ 12 reports -Wrestrict inside its own string concatenation (GCC bug 105651). Of headers that were
# compiled once it forgets that they are the system's, and reports their array bounds, too. The cross builds keep these warnings.
add_library(armcal_host_rules INTERFACE)
target_link_libraries(armcal_host_rules INTERFACE armcal_rules)
target_compile_options(armcal_host_rules INTERFACE -Wno-restrict -Wno-array-bounds -Wno-stringop-overflow)
target_include_directories(armcal_host_rules INTERFACE ${ARMCAL_TOP})
target_compile_features(armcal_host_rules INTERFACE cxx_std_20)
if(NOT CMAKE_CROSSCOMPILING)
  # Headers that are compiled once need the same definitions in all rooms. The generator alone does without fmt.
  find_package(tomlplusplus REQUIRED)
  find_package(nlohmann_json REQUIRED)
  find_package(fmt QUIET)
  target_link_libraries(armcal_host_rules INTERFACE tomlplusplus::tomlplusplus nlohmann_json::nlohmann_json $<TARGET_NAME_IF_EXISTS:fmt::fmt>)
endif()
if(CMAKE_CXX_COMPILER_ID STREQUAL GNU)
  # The compiler looks for memory to free from 1 GB on, not from 128 MB on. It needs up to 0.6 GB more memory and about 15 % less time.
  target_compile_options(armcal_host_rules INTERFACE "SHELL:--param ggc-min-heapsize=1000000")
endif()

if(ARMCAL_SANITIZE AND NOT CMAKE_CROSSCOMPILING)
  # Three checks of a pointer before each use are left out. They take a sixth of the time to compile, and a use that they would find ends
  # in AddressSanitizer's report. GCC's manual: with sanitizers -Wmaybe-uninitialized reports what is not there.
  target_compile_options(armcal_rules INTERFACE -fsanitize=address,undefined -fno-sanitize=null,object-size,vptr
                         -fno-sanitize-recover=all -O1 -Wno-maybe-uninitialized)
  target_link_options(armcal_rules INTERFACE -fsanitize=address,undefined)
endif()

# armcal_library(NAME [SOURCES ...] [LIBS ...]): a room of lib. C++17, no exceptions, no RTTI. Without sources: headers only.
function(armcal_library name)
  cmake_parse_arguments(A "" "" "SOURCES;LIBS" ${ARGN})
  if(A_SOURCES)
    add_library(${name} STATIC ${A_SOURCES})
    target_link_libraries(${name} PUBLIC armcal_lib_rules ${A_LIBS})
    target_compile_options(${name} PRIVATE -fno-exceptions -fno-rtti -fno-threadsafe-statics)
    set_target_properties(${name} PROPERTIES UNITY_BUILD OFF)  # file by file, as it ships
    target_compile_features(${name} PUBLIC cxx_std_17)
  else()
    add_library(${name} INTERFACE)
    target_link_libraries(${name} INTERFACE armcal_lib_rules ${A_LIBS})
    target_compile_features(${name} INTERFACE cxx_std_17)
  endif()
endfunction()

# armcal_headers(NAME HEADERS ... RULES ...): compiles headers once for all targets of these rules. A target takes them by REUSE_FROM.
function(armcal_headers name)
  cmake_parse_arguments(A "" "" "HEADERS;RULES" ${ARGN})
  file(GENERATE OUTPUT ${CMAKE_CURRENT_BINARY_DIR}/${name}.cpp CONTENT "")
  add_library(${name} OBJECT EXCLUDE_FROM_ALL ${CMAKE_CURRENT_BINARY_DIR}/${name}.cpp)
  target_link_libraries(${name} PRIVATE ${A_RULES})
  target_precompile_headers(${name} PRIVATE ${A_HEADERS})
endfunction()

# A Python module links the rooms of the host, too. Nothing from outside replaces their functions, so they are compiled as for a program.
set(armcal_for_modules POSITION_INDEPENDENT_CODE ON CXX_VISIBILITY_PRESET hidden VISIBILITY_INLINES_HIDDEN ON)

# ARMCAL_BUILT: the build folder of the preset host, whose rooms are linked; empty: they are compiled.
set(ARMCAL_BUILT "" CACHE PATH "build folder of the preset host, whose rooms are linked")

# armcal_eigen_once: what the headers below declare as compiled elsewhere. Saves a seventh of the time of a build.
function(armcal_need_eigen_once)
  if(TARGET armcal_eigen_once)
    return()
  endif()
  find_package(Eigen3 REQUIRED NO_MODULE)
  if(ARMCAL_BUILT)
    add_library(armcal_eigen_once STATIC IMPORTED GLOBAL)
    set_target_properties(armcal_eigen_once PROPERTIES IMPORTED_LOCATION ${ARMCAL_BUILT}/libarmcal_eigen_once.a)
    return()
  endif()
  set(header ${ARMCAL_TOP}/toolchains/eigen_once.hpp)
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${header})
  file(READ ${header} text)
  string(REPLACE "extern template" "template" text "${text}")
  string(REPLACE "#pragma once" "" text "${text}")
  file(CONFIGURE OUTPUT ${CMAKE_BINARY_DIR}/eigen_once.cpp CONTENT "${text}" @ONLY)
  add_library(armcal_eigen_once STATIC ${CMAKE_BINARY_DIR}/eigen_once.cpp)
  target_link_libraries(armcal_eigen_once PRIVATE armcal_host_rules Eigen3::Eigen)
  if(ARMCAL_SANITIZE)
    target_compile_options(armcal_eigen_once PRIVATE -fno-sanitize=all)  # Eigen's own code
  endif()
  set_target_properties(armcal_eigen_once PROPERTIES ${armcal_for_modules} ARCHIVE_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR})
endfunction()
set(armcal_shared_headers "${ARMCAL_TOP}/toolchains/eigen_once.hpp" <Eigen/SparseCore> <algorithm> <array> <atomic> <chrono> <cmath> <filesystem>
    <fstream> <functional> <map> <memory> <nlohmann/json.hpp> <numbers> <optional> <random> <set> <span> <sstream> <string> <thread>
    <toml++/toml.h> <vector>)
if(TARGET fmt::fmt)
  list(APPEND armcal_shared_headers <fmt/format.h> <fmt/ranges.h>)
endif()

# armcal_host_library(NAME SOURCES ... [LIBS ...]): a room of codegen/src or host_sim. C++20; includes from the top folder.
function(armcal_host_library name)
  cmake_parse_arguments(A "" "" "SOURCES;LIBS" ${ARGN})
  armcal_need_eigen_once()
  if(ARMCAL_BUILT)
    file(RELATIVE_PATH room ${ARMCAL_TOP} ${CMAKE_CURRENT_SOURCE_DIR})
    add_library(${name}_built STATIC IMPORTED GLOBAL)
    set_target_properties(${name}_built PROPERTIES IMPORTED_LOCATION ${ARMCAL_BUILT}/${room}/lib${name}.a)
    target_link_libraries(${name}_built INTERFACE armcal_host_rules ${A_LIBS} armcal_eigen_once)
    # An empty library, because a room may set properties of its own that an imported library can't have.
    file(GENERATE OUTPUT ${CMAKE_CURRENT_BINARY_DIR}/${name}.cpp CONTENT "")
    add_library(${name} STATIC ${CMAKE_CURRENT_BINARY_DIR}/${name}.cpp)
    target_link_libraries(${name} PUBLIC ${name}_built)
    return()
  endif()
  add_library(${name} STATIC ${A_SOURCES})
  target_link_libraries(${name} PUBLIC armcal_host_rules ${A_LIBS} armcal_eigen_once)
  if(NOT TARGET armcal_host_headers)
    find_package(Eigen3 REQUIRED NO_MODULE)
    armcal_headers(armcal_host_headers HEADERS ${armcal_shared_headers} RULES armcal_host_rules Eigen3::Eigen)
    set_target_properties(armcal_host_headers PROPERTIES ${armcal_for_modules})
  endif()
  target_precompile_headers(${name} REUSE_FROM armcal_host_headers)
  set_target_properties(${name} PROPERTIES ${armcal_for_modules})
endfunction()

# Tests are many, and nearly all take longer to compile than to run: optimised little. Oracles are in double. Linked last: lib's rules,
# which a test gets from the rooms it links, would have the last word. With sanitizers optimising would double the time to compile.
add_library(armcal_test_rules INTERFACE)
target_compile_options(armcal_test_rules INTERFACE $<IF:$<BOOL:${ARMCAL_SANITIZE}>,-O0,-O1> -Wno-double-promotion)

# The test executables labelled fast: what the sanitizer build makes.
add_custom_target(fast_tests)

# The test executables labelled long: nothing else builds them.
add_custom_target(long_tests)

# armcal_test(NAME SOURCES ... [LIBS ...] [LABELS fast|all|long]): one GoogleTest executable, one CTest entry.
function(armcal_test name)
  cmake_parse_arguments(A "" "LABELS;TIMEOUT" "SOURCES;LIBS" ${ARGN})
  add_executable(${name} ${A_SOURCES})
  armcal_need_eigen_once()
  target_link_libraries(${name} PRIVATE armcal_host_rules ${A_LIBS} armcal_test_rules GTest::gtest_main armcal_eigen_once)
  if(NOT TARGET armcal_test_headers)
    find_package(Eigen3 REQUIRED NO_MODULE)
    armcal_headers(armcal_test_headers HEADERS <gtest/gtest.h> ${armcal_shared_headers}
                   RULES armcal_host_rules Eigen3::Eigen armcal_test_rules GTest::gtest_main)
  endif()
  target_precompile_headers(${name} REUSE_FROM armcal_test_headers)
  add_test(NAME ${name} COMMAND ${name} WORKING_DIRECTORY ${PROJECT_SOURCE_DIR})
  if(NOT A_LABELS)
    set(A_LABELS fast)
  endif()
  if(NOT A_TIMEOUT)
    set(A_TIMEOUT 300)
  endif()
  set_tests_properties(${name} PROPERTIES LABELS ${A_LABELS} TIMEOUT ${A_TIMEOUT})
  if(A_LABELS STREQUAL fast)
    add_dependencies(fast_tests ${name})
  elseif(A_LABELS STREQUAL long)
    add_dependencies(long_tests ${name})
    set_target_properties(${name} PROPERTIES EXCLUDE_FROM_ALL ON)
  endif()
endfunction()

# armcal_long_part(NAME TIMEOUT): the suites of NAME that begin with Long run as a CTest entry of their own, which is long.
function(armcal_long_part name timeout)
  set_tests_properties(${name} PROPERTIES ENVIRONMENT "GTEST_FILTER=-Long*")
  add_test(NAME ${name}_long COMMAND ${name} WORKING_DIRECTORY ${PROJECT_SOURCE_DIR})
  set_tests_properties(${name}_long PROPERTIES LABELS long TIMEOUT ${timeout} ENVIRONMENT "GTEST_FILTER=Long*")
endfunction()

# armcal_emitted_models(NAME SOURCES ... FOLDERS ...): models that a program of these sources writes while building; it
# is called with the folders, which lie in the build folder. Link NAME to include <folder/model.hpp>.
function(armcal_emitted_models name)
  cmake_parse_arguments(A "" "" "SOURCES;FOLDERS" ${ARGN})
  add_executable(emit_${name} ${A_SOURCES})
  target_link_libraries(emit_${name} PRIVATE armcal_codegen)
  file(GLOB inputs CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/codegen/effects/*.toml)
  list(APPEND inputs ${PROJECT_SOURCE_DIR}/codegen/robots/er20_like.toml)
  list(TRANSFORM A_FOLDERS PREPEND ${CMAKE_CURRENT_BINARY_DIR}/)
  set(headers ${A_FOLDERS})
  list(TRANSFORM headers APPEND /model.hpp)
  add_custom_command(OUTPUT ${headers} WORKING_DIRECTORY ${PROJECT_SOURCE_DIR} COMMAND emit_${name} ${A_FOLDERS}
                     DEPENDS emit_${name} ${inputs})
  add_custom_target(${name}_files DEPENDS ${headers})
  add_library(${name} INTERFACE)
  add_dependencies(${name} ${name}_files)
  target_include_directories(${name} INTERFACE ${CMAKE_CURRENT_BINARY_DIR})
endfunction()

# armcal_add_rooms([FOLDER]): adds the folder's own CMakeLists.txt and those of its subfolders, as far as there are any.
function(armcal_add_rooms)
  set(top ${CMAKE_CURRENT_SOURCE_DIR})
  file(GLOB rooms CONFIGURE_DEPENDS RELATIVE ${top} ${top}/${ARGV0}/*/CMakeLists.txt)
  if(ARGV0 AND EXISTS ${top}/${ARGV0}/CMakeLists.txt)
    list(APPEND rooms ${ARGV0}/CMakeLists.txt)
  endif()
  foreach(room ${rooms})
    get_filename_component(room ${room} DIRECTORY)
    add_subdirectory(${room})
  endforeach()
endfunction()
