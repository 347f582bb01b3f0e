# For a project that uses armcal: the C++ model of a robot file as a target, generated when the file, an effect record or the tool changes.
#
#   find_package(armcal REQUIRED)                           # or include(<armcal>/toolchains/armcal_add_model.cmake)
#   armcal_add_model(my_arm ROBOT my_arm.toml)
#   target_link_libraries(firmware PRIVATE my_arm)          # #include <model.hpp>, <dynamics.hpp>, <armcal/...>
#
# armcal_add_model(TARGET ROBOT FILE [NAME FOLDER]) makes the interface library TARGET with lib and the generated folder as include
# folders. NAME: the headers are included as <FOLDER/model.hpp>, for a project with more than one model. armcal::model_<file>, with the
# file's name without its suffix, is another name of TARGET. A bad robot file ends the build with one line that names file and key.
#
# The generator runs on the PC, in a cross build, too. It is, in this order: the target `armcal-generate` of this very build; the program
# that ARMCAL_GENERATE names (cache variable or environment); the installed package's own; `armcal-generate` in <armcal>/build/host or on
# the PATH; else it is built from the checkout with the PC's own compiler, under the build folder. That takes ten compile steps at most and these Debian
# packages: g++ cmake ninja-build libeigen3-dev libtomlplusplus-dev nlohmann-json3-dev libcli11-dev; and pkg-config liburdfdom-dev
# for robot files that name a URDF.
include_guard(GLOBAL)
include(ExternalProject)

# Sets `out` to the generator's program and `wait_for` to the target that builds it, if one does.
function(armcal_find_generator out wait_for)
  set(${wait_for} "" PARENT_SCOPE)
  if(TARGET armcal-generate AND NOT CMAKE_CROSSCOMPILING)
    set(${out} $<TARGET_FILE:armcal-generate> PARENT_SCOPE)
    set(${wait_for} armcal-generate PARENT_SCOPE)
    return()
  endif()
  if(NOT ARMCAL_GENERATE AND DEFINED ENV{ARMCAL_GENERATE})
    set(ARMCAL_GENERATE $ENV{ARMCAL_GENERATE})
  endif()
  if(ARMCAL_GENERATE AND NOT EXISTS ${ARMCAL_GENERATE})
    message(FATAL_ERROR "ARMCAL_GENERATE: ${ARMCAL_GENERATE}: no such program")
  endif()
  if(NOT ARMCAL_GENERATE AND TARGET armcal::generate)
    get_target_property(ARMCAL_GENERATE armcal::generate IMPORTED_LOCATION)
  endif()
  get_filename_component(ARMCAL_CHECKOUT ${CMAKE_CURRENT_FUNCTION_LIST_DIR} DIRECTORY)
  if(NOT ARMCAL_GENERATE)
    find_program(ARMCAL_FOUND_GENERATE armcal-generate HINTS ${ARMCAL_CHECKOUT}/build/host NO_CMAKE_FIND_ROOT_PATH)
    set(ARMCAL_GENERATE ${ARMCAL_FOUND_GENERATE})
  endif()
  if(NOT ARMCAL_GENERATE AND NOT EXISTS ${ARMCAL_CHECKOUT}/codegen/CMakeLists.txt)
    message(FATAL_ERROR "armcal-generate: not found in the package ${ARMCAL_CHECKOUT} nor on the PATH; set ARMCAL_GENERATE to the program")
  endif()
  if(NOT ARMCAL_GENERATE)
    set(folder ${CMAKE_BINARY_DIR}/armcal_generate_program)
    set(ARMCAL_GENERATE ${folder}/armcal-generate)
    if(NOT TARGET armcal_generate_program)
      ExternalProject_Add(armcal_generate_program
        SOURCE_DIR ${ARMCAL_CHECKOUT}/codegen BINARY_DIR ${folder} PREFIX ${folder}.state
        CONFIGURE_COMMAND ${CMAKE_COMMAND} -G ${CMAKE_GENERATOR} -S ${ARMCAL_CHECKOUT}/codegen -B ${folder} -DCMAKE_BUILD_TYPE=Release -DCMAKE_UNITY_BUILD=ON
        BUILD_COMMAND ${CMAKE_COMMAND} --build ${folder} --target armcal-generate
        BUILD_ALWAYS ON INSTALL_COMMAND "" BUILD_BYPRODUCTS ${ARMCAL_GENERATE})
    endif()
    set(${wait_for} armcal_generate_program PARENT_SCOPE)
  endif()
  set(${out} ${ARMCAL_GENERATE} PARENT_SCOPE)
endfunction()

function(armcal_add_model target)
  cmake_parse_arguments(A "" "ROBOT;NAME" "" ${ARGN})
  if(NOT A_ROBOT OR A_UNPARSED_ARGUMENTS)
    message(FATAL_ERROR "armcal_add_model(${target} ...): expected ROBOT file.toml and nothing but NAME beside it")
  endif()
  get_filename_component(robot ${A_ROBOT} ABSOLUTE BASE_DIR ${CMAKE_CURRENT_SOURCE_DIR})
  if(NOT EXISTS ${robot})
    message(FATAL_ERROR "armcal_add_model(${target} ...): ${robot}: no such robot file")
  endif()
  get_filename_component(ARMCAL_CHECKOUT ${CMAKE_CURRENT_FUNCTION_LIST_DIR} DIRECTORY)  # or the installed package
  armcal_find_generator(tool wait_for)
  set(include ${CMAKE_CURRENT_BINARY_DIR}/${target}.model)
  set(folder ${include})
  if(A_NAME)
    string(APPEND folder /${A_NAME})
  endif()
  file(GLOB records CONFIGURE_DEPENDS ${ARMCAL_CHECKOUT}/codegen/effects/*.toml)
  # A robot file may name a URDF, from its own folder.
  set(urdf)
  file(STRINGS ${robot} named REGEX "^[ \t]*urdf[ \t]*=[ \t]*\"[^\"]+\"")
  if(named MATCHES "\"([^\"]+)\"")
    get_filename_component(folder_of_robot ${robot} DIRECTORY)
    get_filename_component(urdf ${CMAKE_MATCH_1} ABSOLUTE BASE_DIR ${folder_of_robot})
  endif()
  add_custom_command(OUTPUT ${folder}/model.hpp VERBATIM
    COMMAND ${CMAKE_COMMAND} -E env ARMCAL_HOME=${ARMCAL_CHECKOUT} ${tool} --robot ${robot} --out ${folder}
    COMMAND ${CMAKE_COMMAND} -E touch ${folder}/model.hpp
    DEPENDS ${robot} ${urdf} ${records} ${tool} ${wait_for})
  add_custom_target(${target}_files DEPENDS ${folder}/model.hpp)
  add_library(${target} INTERFACE)
  add_dependencies(${target} ${target}_files)
  target_include_directories(${target} INTERFACE ${include})
  if(TARGET armcal::headers)
    target_link_libraries(${target} INTERFACE armcal::headers)
  else()
    target_include_directories(${target} INTERFACE ${ARMCAL_CHECKOUT}/lib)
    target_compile_features(${target} INTERFACE cxx_std_17)
    # As armcal's own code is compiled: host and target agree bit for bit, and a square root is one instruction.
    target_compile_options(${target} INTERFACE -ffp-contract=off -fno-fast-math -fno-math-errno)
  endif()
  get_filename_component(name ${robot} NAME_WE)
  if(NOT TARGET armcal::model_${name})
    add_library(armcal::model_${name} ALIAS ${target})
  endif()
endfunction()
