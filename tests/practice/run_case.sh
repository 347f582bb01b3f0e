#!/usr/bin/env bash
# practice - diagnoses one case: a folder with case.json, train.csv.gz and test.csv.gz, its arm in ROBOTS_DIR.
#   tests/practice/run_case.sh CASE_DIR ROBOTS_DIR OUT.json
# Needs build/host (cmake --build --preset host --target armcal practice_robot); another build folder: ARMCAL_BUILD.
set -euo pipefail

[[ $# -eq 3 ]] || { sed -n '2,4p' "$0" >&2; exit 2; }
case_dir=$(realpath "$1") robots_dir=$(realpath "$2") out=$(realpath -m "$3")
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
build=$(realpath "${ARMCAL_BUILD:-build/host}")

file() { sed -n "s/.*\"$1\": *\"\([^\"]*\.csv[^\"]*\)\".*/\1/p" "$case_dir/case.json" | head -n 1; }
robot=$(mktemp --suffix=.toml)
trap 'rm -f "$robot"' EXIT
"$build/tests/practice/practice_robot" "$case_dir" "$robots_dir" >"$robot"
"$build/armcal" diagnose --robot "$robot" --train "$case_dir/$(file train)" --test "$case_dir/$(file test)" --json "$out"
