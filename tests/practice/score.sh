#!/usr/bin/env bash
# practice - diagnoses all cases of a folder and compares the verdicts with the truth beside each.
#   tests/practice/score.sh CASES_DIR [ROBOTS_DIR [OUT_DIR]]    defaults: CASES_DIR/robots, a temporary folder
# One line a case, one total; 0 only if all are right. ONLY=regular expression picks cases.
set -uo pipefail

[[ $# -ge 1 ]] || { sed -n '2,4p' "$0" >&2; exit 2; }
here=$(realpath "$(dirname "${BASH_SOURCE[0]}")")
cases=$(realpath "$1") robots=$(realpath "${2:-$1/robots}")
if [[ $# -ge 3 ]]; then mkdir -p "$3" && out=$(realpath "$3"); else out=$(mktemp -d) && trap 'rm -rf "$out"' EXIT; fi

for one in "$cases"/*/; do
  name=$(basename "$one")
  [[ -f $one/case.json && $name =~ ${ONLY:-.} ]] || continue
  rm -f "$out/$name.json"
  "$here/run_case.sh" "$one" "$robots" "$out/$name.json" >"$out/$name.txt" 2>&1 || tail -n 1 "$out/$name.txt" >&2
done
"$(realpath "${ARMCAL_BUILD:-$here/../../build/host}")/tests/practice/practice_score" "$cases" "$out"
