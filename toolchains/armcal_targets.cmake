# For a project that uses armcal: its targets. find_package(armcal), FetchContent and add_subdirectory all read this file.
#
#   armcal::headers         the include folder, C++17, and the options that equal bits depend on
#   armcal::lib             armcal::headers and the library's sources, which the target that links it compiles with its own flags
#   armcal::eigen           armcal::headers and Eigen's include folder, if Eigen is there
#   armcal::model_<robot>   a model that armcal brings: #include <model.hpp>, or <<robot>/model.hpp> beside other models
#   armcal::generate        the program armcal-generate of the PC, if it is installed
#   armcal_add_model(...)   the model of a robot file of yours, see armcal_add_model.cmake
#
# One installed package serves a PC and every target, because nothing of it is compiled for a machine but its programs. Link armcal::lib
# to one target of an image, and armcal::headers to the others: two targets with the sources would define everything twice.
include_guard(GLOBAL)
include(${CMAKE_CURRENT_LIST_DIR}/armcal_add_model.cmake)

add_library(armcal_package_headers INTERFACE)
add_library(armcal::headers ALIAS armcal_package_headers)
get_filename_component(armcal_home ${CMAKE_CURRENT_LIST_DIR} DIRECTORY)
# As a system's folder: the warnings of the user's project are for the user's code.
target_include_directories(armcal_package_headers SYSTEM INTERFACE ${armcal_home}/lib)
target_compile_features(armcal_package_headers INTERFACE cxx_std_17)
target_compile_options(armcal_package_headers INTERFACE
                       "$<$<COMPILE_LANGUAGE:C,CXX>:-ffp-contract=off;-fno-fast-math;-fno-math-errno>")

file(GLOB_RECURSE armcal_sources ${armcal_home}/lib/armcal/*.cpp)
add_library(armcal_package_lib INTERFACE)
add_library(armcal::lib ALIAS armcal_package_lib)
target_sources(armcal_package_lib INTERFACE ${armcal_sources})
target_link_libraries(armcal_package_lib INTERFACE armcal_package_headers)

find_package(Eigen3 QUIET NO_MODULE)
if(TARGET Eigen3::Eigen)
  get_target_property(armcal_eigen Eigen3::Eigen INTERFACE_INCLUDE_DIRECTORIES)
  add_library(armcal_package_eigen INTERFACE)
  add_library(armcal::eigen ALIAS armcal_package_eigen)
  target_include_directories(armcal_package_eigen SYSTEM INTERFACE ${armcal_eigen})
  target_link_libraries(armcal_package_eigen INTERFACE armcal_package_headers)
endif()

file(GLOB armcal_models RELATIVE ${armcal_home}/codegen/generated ${armcal_home}/codegen/generated/*/model.hpp)
foreach(armcal_model ${armcal_models})
  get_filename_component(armcal_robot ${armcal_model} DIRECTORY)
  add_library(armcal_package_model_${armcal_robot} INTERFACE)
  add_library(armcal::model_${armcal_robot} ALIAS armcal_package_model_${armcal_robot})
  target_include_directories(armcal_package_model_${armcal_robot} SYSTEM INTERFACE ${armcal_home}/codegen/generated/${armcal_robot}
                             ${armcal_home}/codegen/generated)
  target_link_libraries(armcal_package_model_${armcal_robot} INTERFACE armcal_package_headers)
endforeach()

# A package in <prefix>/share/armcal has its programs in <prefix>/bin.
if(EXISTS ${armcal_home}/../../bin/armcal-generate)
  get_filename_component(armcal_program ${armcal_home}/../../bin/armcal-generate ABSOLUTE)
  add_executable(armcal::generate IMPORTED GLOBAL)
  set_target_properties(armcal::generate PROPERTIES IMPORTED_LOCATION ${armcal_program})
endif()
