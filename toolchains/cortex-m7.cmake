# Cortex-M7, double-precision FPU; the image is for the MPS2 board AN500 (QEMU: mps2-an500).
set(ARMCAL_CPU_FLAGS "-mcpu=cortex-m7 -mthumb -mfpu=fpv5-d16 -mfloat-abi=hard")
set(ARMCAL_BOARD mps2-an500)
include(${CMAKE_CURRENT_LIST_DIR}/arm-none-eabi.cmake)
