#!/usr/bin/env bash
# practice - all cases of the data folder; skipped (77) where there is none.
#   tests/practice/run_data.sh BUILD_FOLDER    with ARMCAL_DATA set
set -uo pipefail

[[ -d ${ARMCAL_DATA:-}/practice ]] || { echo "no practice logs: ARMCAL_DATA is not set"; exit 77; }
ARMCAL_BUILD=$1 exec "$(dirname "${BASH_SOURCE[0]}")/score.sh" "$ARMCAL_DATA/practice"
