#!/usr/bin/env bash
# tests - an outside project meets armcal in each of its ways: installed, fetched, as a subfolder; on the PC, for a Cortex-M4F and a Cortex-M7.
#   ways.sh CHECKOUT BUILD_FOLDER ARMCAL_GENERATE
set -euo pipefail
checkout=$1 build=$2 generate=$3 here=$(dirname "$(realpath "$0")")
rm -rf "$build"
mkdir -p "$build"
trap '[[ $? == 0 ]] || cat "$build/log"' EXIT
export CMAKE_GENERATOR=Ninja

# Installed without the host's programs. Packages that the tool and the tests need are hidden: nothing may ask for them.
hidden=()
for package in orocos_kdl PkgConfig GTest fmt CLI11 nlohmann_json; do hidden+=("-DCMAKE_DISABLE_FIND_PACKAGE_$package=ON"); done
cmake -S "$checkout" -B "$build/library" -DARMCAL_LIBRARY_ONLY=ON -DCMAKE_INSTALL_PREFIX="$build/prefix" "${hidden[@]}" >"$build/log" 2>&1
cmake --install "$build/library" >>"$build/log" 2>&1
mkdir "$build/prefix/bin"
ln -s "$generate" "$build/prefix/bin/armcal-generate"  # as an installed tool lies

# way NAME OPTIONS...: configures and builds. Where UNITY is ON the library's sources are compiled together, which is quicker.
way() {
  local start=$SECONDS
  cmake -S "$here/consumer" -B "$build/$1" -DCMAKE_BUILD_TYPE=Debug -DCMAKE_UNITY_BUILD="${UNITY:-OFF}" "${@:2}" >"$build/log" 2>&1
  cmake --build "$build/$1" -j2 >>"$build/log" 2>&1
  echo "$1: $((SECONDS - start)) s"
}
# rules NAME: the user's own sources are compiled with the rules that equal bits rest on.
rules() {
  for flag in -ffp-contract=off -fno-fast-math -fno-math-errno; do
    grep -q -- "FLAGS = .*$flag" "$build/$1/build.ninja" || { echo "$1: $flag is missing"; exit 1; }
  done
}
way package -DWAY=package -DCMAKE_PREFIX_PATH="$build/prefix"
"$build/package/consumer"
rules package
grep -q "$build/prefix/bin/armcal-generate" "$build/package/build.ninja"
export ARMCAL_GENERATE=$generate UNITY=ON
way fetch -DWAY=fetch -DARMCAL="$checkout"
"$build/fetch/consumer"
rules fetch
way subdirectory -DWAY=subdirectory -DARMCAL="$checkout"
"$build/subdirectory/consumer"
rules subdirectory
if ! command -v arm-none-eabi-g++ >/dev/null; then
  echo "arm-none-eabi-g++ is not there: the Cortex-M is left out"
  exit 0
fi
# for_core NAME CORE OPTIONS...
for_core() {
  way "$1" -DCMAKE_TOOLCHAIN_FILE="$checkout/toolchains/cortex-$2.cmake" "${@:3}"
  rules "$1"
  grep -q "FLAGS = .*-mcpu=cortex-${2%f}" "$build/$1/build.ninja"
}
for_core fetch-m4f m4f -DWAY=fetch -DARMCAL="$checkout"
for_core subdirectory-m4f m4f -DWAY=subdirectory -DARMCAL="$checkout"
unset ARMCAL_GENERATE
for core in m4f m7; do for_core package-$core $core -DWAY=package -DCMAKE_PREFIX_PATH="$build/prefix"; done
