# Cortex-M4F, single-precision FPU; the image is for the MPS2 board AN386 (QEMU: mps2-an386).
set(ARMCAL_CPU_FLAGS "-mcpu=cortex-m4 -mthumb -mfpu=fpv4-sp-d16 -mfloat-abi=hard")
set(ARMCAL_BOARD mps2-an386)
include(${CMAKE_CURRENT_LIST_DIR}/arm-none-eabi.cmake)
