// core - the version of armcal, for #if and for text. CMake, packages and programs read it here, and nowhere else.
#pragma once

// Major, minor and patch, two hexadecimal digits each: 0x010203 is 1.2.3.
#define ARMCAL_VERSION 0x000100
