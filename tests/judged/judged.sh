#!/usr/bin/env bash
# judged set - makes cases with a known truth, diagnoses each, prints shares with 95 % intervals.
#   tests/judged/judged.sh sample|tuning|report [SEED] [OUT_DIR]
# sample: 39 cases, a minute, runs among the tests and fails below its shares. tuning: seed 1, for whoever changes the
# diagnosis. report: a seed that nothing was tuned on; use it once.
# Needs build/host (targets armcal, practice_robot, judged_set, judged_score); another build folder: ARMCAL_BUILD.
set -euo pipefail

here=$(realpath "$(dirname "${BASH_SOURCE[0]}")")
build=$(realpath "${ARMCAL_BUILD:-$here/../../build/host}")
part=${1:-} seed=${2:-1} out=$(realpath -m "${3:-$build/judged_$part}")
shares=()
case $part in
  sample)
    counts="controls 6 singles 28 pairs 2 unknowns 3"
    # far below what larger sets show: with so few cases chance alone moves a share by a tenth
    shares=("controls: silent=100" "single: joint=80" "single: kind or class, and joint=75" "noise floor within 5 %=90") ;;
  tuning) counts="controls 120 singles 280 pairs 40 unknowns 40 detection 140" ;;
  report) counts="controls 600 singles 420 pairs 100 unknowns 100 detection 580" ;;
  *) sed -n '3,6p' "$0" >&2; exit 2 ;;
esac

rm -rf "$out" && mkdir -p "$out/verdicts"
set -- $counts
makers=()
while [[ $# -gt 0 ]]; do
  echo "making $2 $1, seed $seed"
  "$build/tests/judged/judged_set" "$out/cases" "$seed" "$1" "$2" &
  makers+=($!)
  shift 2
done
for maker in "${makers[@]}"; do wait "$maker"; done
export build out here
one() {
  "$here/../practice/run_case.sh" "$out/cases/$1" "$out/cases/robots" "$out/verdicts/$1.json" >"$out/verdicts/$1.txt" 2>&1 ||
    echo "$1: $(tail -n 1 "$out/verdicts/$1.txt")" >&2
}
export -f one
find "$out/cases" -mindepth 1 -maxdepth 1 -type d ! -name robots -printf '%f\n' | sort | ARMCAL_BUILD=$build xargs -P "$(nproc)" -I{} bash -c 'one {}'
"$build/tests/judged/judged_score" "$out/cases" "$out/verdicts" "$out/score.json" "${shares[@]}"
