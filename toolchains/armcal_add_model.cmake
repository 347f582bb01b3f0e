# For a project that uses armcal: the C++ model of a robot file as a target, generated when the file, an effect record or the tool changes.
#
#   include(<armcal>/toolchains/armcal_add_model.cmake)
#   armcal_add_model(my_arm ROBOT my_arm.toml)
#   target_link_libraries(firmware PRIVATE my_arm)          # #include <model.hpp>, <dynamics.hpp>, <armcal/...>
#
# armcal_add_model(TARGET ROBOT FILE [NAME FOLDER]) makes the interface library TARGET with lib and the generated folder as include
# folders. NAME: the headers are included as <FOLDER/model.hpp>, for a project with more than one model. A bad robot file ends the build
# with one line that names file and key.
#
# The generator runs on the PC, in a cross build, too. It is, in this order: the target `armcal` of this very build; the program that
# ARMCAL_TOOL names (cache variable or environment); `armcal` in <armcal>/build/host or on the PATH; else it is built from the checkout
# with the PC's own compiler, under the build folder (needs toolchains/install.sh host).
include_guard(GLOBAL)
include(ExternalProject)
get_filename_component(ARMCAL_CHECKOUT ${CMAKE_CURRENT_LIST_DIR} DIRECTORY)

# Sets `out` to the generator's program and `wait_for` to the target that builds it, if one does.
function(armcal_find_tool out wait_for)
  set(${wait_for} "" PARENT_SCOPE)
  if(TARGET armcal AND NOT CMAKE_CROSSCOMPILING)
    set(${out} $<TARGET_FILE:armcal> PARENT_SCOPE)
    set(${wait_for} armcal PARENT_SCOPE)
    return()
  endif()
  if(NOT ARMCAL_TOOL AND DEFINED ENV{ARMCAL_TOOL})
    set(ARMCAL_TOOL $ENV{ARMCAL_TOOL})
  endif()
  if(ARMCAL_TOOL AND NOT EXISTS ${ARMCAL_TOOL})
    message(FATAL_ERROR "ARMCAL_TOOL: ${ARMCAL_TOOL}: no such program")
  endif()
  if(NOT ARMCAL_TOOL)
    find_program(ARMCAL_FOUND_TOOL armcal HINTS ${ARMCAL_CHECKOUT}/build/host NO_CMAKE_FIND_ROOT_PATH)
    set(ARMCAL_TOOL ${ARMCAL_FOUND_TOOL})
  endif()
  if(NOT ARMCAL_TOOL)
    set(folder ${CMAKE_BINARY_DIR}/armcal_host_tool)
    set(ARMCAL_TOOL ${folder}/armcal)
    if(NOT TARGET armcal_host_tool)
      ExternalProject_Add(armcal_host_tool
        SOURCE_DIR ${ARMCAL_CHECKOUT} BINARY_DIR ${folder} PREFIX ${folder}.state
        CONFIGURE_COMMAND ${CMAKE_COMMAND} -G ${CMAKE_GENERATOR} -S ${ARMCAL_CHECKOUT} -B ${folder} -DCMAKE_BUILD_TYPE=Release -DCMAKE_UNITY_BUILD=ON
        BUILD_COMMAND ${CMAKE_COMMAND} --build ${folder} --target armcal
        BUILD_ALWAYS ON INSTALL_COMMAND "" BUILD_BYPRODUCTS ${ARMCAL_TOOL})
    endif()
    set(${wait_for} armcal_host_tool PARENT_SCOPE)
  endif()
  set(${out} ${ARMCAL_TOOL} PARENT_SCOPE)
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
  armcal_find_tool(tool wait_for)
  set(include ${CMAKE_CURRENT_BINARY_DIR}/${target}.model)
  set(folder ${include})
  if(A_NAME)
    string(APPEND folder /${A_NAME})
  endif()
  file(GLOB records CONFIGURE_DEPENDS ${ARMCAL_CHECKOUT}/codegen/effects/*.toml)
  add_custom_command(OUTPUT ${folder}/model.hpp VERBATIM
    COMMAND ${CMAKE_COMMAND} -E env ARMCAL_HOME=${ARMCAL_CHECKOUT} ${tool} generate --robot ${robot} --out ${folder}
    COMMAND ${CMAKE_COMMAND} -E touch ${folder}/model.hpp
    DEPENDS ${robot} ${records} ${tool} ${wait_for})
  add_custom_target(${target}_files DEPENDS ${folder}/model.hpp)
  add_library(${target} INTERFACE)
  add_dependencies(${target} ${target}_files)
  target_include_directories(${target} INTERFACE ${include} ${ARMCAL_CHECKOUT}/lib)
  target_compile_features(${target} INTERFACE cxx_std_17)
  # As armcal's own code is compiled: host and target agree bit for bit, and a square root is one instruction.
  target_compile_options(${target} INTERFACE -ffp-contract=off -fno-fast-math -fno-math-errno)
endfunction()
