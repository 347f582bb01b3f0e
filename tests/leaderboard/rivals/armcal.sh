#!/usr/bin/env bash
# row: armcal | `armcal diagnose`, defaults; the held-out log confirms or refutes its terms
set -euo pipefail
exec "$(dirname "${BASH_SOURCE[0]}")/../../practice/run_case.sh" "$1" "$1/../../robots" "$2"
