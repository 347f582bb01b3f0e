#!/usr/bin/env bash
# tests - the generator as a project of its own: it asks for no package of the simulator, and takes ten compile steps at most.
#   stands_alone.sh CHECKOUT BUILD_FOLDER
set -euo pipefail
checkout=$1
build=$2
rm -rf "$build"
hidden=()
for package in orocos_kdl Pagmo fmt ZLIB GTest Boost; do hidden+=("-DCMAKE_DISABLE_FIND_PACKAGE_$package=ON"); done
cmake -G Ninja -S "$checkout/codegen" -B "$build" -DCMAKE_BUILD_TYPE=Release -DCMAKE_UNITY_BUILD=ON -DARMCAL_URDF=OFF "${hidden[@]}" >"$build.log" 2>&1 ||
  { cat "$build.log"; exit 1; }
steps=$(ninja -C "$build" -t commands armcal-generate | grep -c -- ' -c ')
echo "$steps compile steps"
((steps <= 10)) || { echo "expected ten at most"; exit 1; }
libraries=$(ninja -C "$build" -t commands armcal-generate | tail -n 1)
for library in kdl modbus pagmo boost urdf fmt libz; do
  [[ $libraries != *"$library"* ]] || { echo "links $library: $libraries"; exit 1; }
done
# Outside the generator's own folder a source may include nothing of the checkout.
! grep -rnE '#include "(host_sim|lib|port|tests|armcal)/' "$checkout/codegen/src"
