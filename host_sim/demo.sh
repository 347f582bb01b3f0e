#!/usr/bin/env bash
# The main job, end to end: sets up what is missing, builds, and closes the loop on the simulated drive.
#   bash host_sim/demo.sh [SCENARIO]     a file, or a name in host_sim/scenarios (default: stribeck)
# Everything that is made lies in build/demo: report.html for people, result.json for programs.
set -euo pipefail
cd "$(dirname "$0")/.."
bash toolchains/install.sh host
echo "configuring and building (build/host)"
cmake --preset host >build_host.txt 2>&1 || { cat build_host.txt; exit 1; }
rm -f build_host.txt
cmake --build --preset host --target armcal armcal-drive-er20_like -j 2 |
  awk '/\[[0-9]+\/[0-9]+\]/ { split(substr($1, 2), n, "/"); share = int(10 * n[1] / (n[2] + 0)); if (share != last) { printf "  built %d0 %%\n", share; fflush(); last = share } next } { print }'
exec build/host/armcal demo ${1:+--scenario "$1"}
