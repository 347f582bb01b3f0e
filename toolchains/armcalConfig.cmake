# What find_package(armcal) reads. It lies beside the folder toolchains, or in it, so that a checkout is a package, too.
include(${CMAKE_CURRENT_LIST_DIR}/../toolchains/armcal_targets.cmake)
