#!/usr/bin/env bash
# judged set - makes cases with a known truth, diagnoses each, prints shares with 95 % intervals.
#   tests/judged/judged.sh sample|tuning|report [SEED] [OUT_DIR] [PERCENT]      set I
#   tests/judged/judged.sh sample2|tuning2|report2 [SEED] [OUT_DIR] [PERCENT]   set II
# sample: a small set, fails below its shares. tuning: seed 1, for whoever changes the diagnosis; OUT_DIR/failures.md
# lists what went wrong in set II. report: a seed that nothing was tuned on; use it once. It adds a line to
# tests/judged/reports.tsv. PERCENT scales the number of cases; below 100 a report adds no line.
# Needs build/host (targets armcal, practice_robot, judged_set, judged_score); another build folder: ARMCAL_BUILD.
set -euo pipefail

here=$(realpath "$(dirname "${BASH_SOURCE[0]}")")
build=$(realpath "${ARMCAL_BUILD:-$here/../../build/host}")
part=${1:-} seed=${2:-1} out=$(realpath -m "${3:-$build/judged_$part}") percent=${4:-100}
shares=()
case $part in
  sample)
    counts="controls 6 singles 28 pairs 2 unknowns 3"
    # far below what larger sets show: with so few cases chance alone moves a share by a tenth
    shares=("controls: silent=100" "single: joint=80" "single: kind or class, and joint=75" "noise floor within 5 %=90") ;;
  tuning) counts="controls 120 singles 280 pairs 40 unknowns 40 detection 140" ;;
  report) counts="controls 600 singles 420 pairs 100 unknowns 100 detection 580" ;;
  sample2)
    counts="controls_plain 3 controls_slow 3 controls_quiet 3 controls_late 3 controls_stamps 3 singles_ii 20 unrecorded 6 several 3 payload 2 negative 2"
    # what must not change even in a tenth of it
    shares=("II controls: silent=80" "II logs that are read=100" "II negative: the joint is named as suspect=100") ;;
  tuning2)
    counts="controls_plain 24 controls_slow 24 controls_quiet 24 controls_late 24 controls_stamps 24 singles_ii 120 unrecorded 36 several 24 payload 12 negative 12" ;;
  report2)
    counts="controls_plain 60 controls_slow 70 controls_quiet 70 controls_late 70 controls_stamps 40 singles_ii 420 unrecorded 110 several 70 payload 30 negative 30" ;;
  *) sed -n '3,8p' "$0" >&2; exit 2 ;;
esac
forms=tuning
[[ $part == report2 ]] && forms=report

rm -rf "$out" && mkdir -p "$out/verdicts"
echo "making $counts, $percent %, seed $seed"
# shellcheck disable=SC2086
printf '%s %s\n' $counts | while read -r group count; do echo "$group $(((count * percent + 99) / 100))"; done |
  xargs -P "$(nproc)" -L 1 sh -c '"$1" "$2" "$3" "$5" "$6" "$4" 0' _ "$build/tests/judged/judged_set" "$out/cases" "$seed" "$forms"
export build out here
one() {
  "$here/../practice/run_case.sh" "$out/cases/$1" "$out/cases/robots" "$out/verdicts/$1.json" >"$out/verdicts/$1.new" 2>&1 ||
    echo "$1: $(tail -n 1 "$out/verdicts/$1.new")" >&2
  mv "$out/verdicts/$1.new" "$out/verdicts/$1.txt"
}
export -f one
# by number, then by group: what stands in OUT_DIR before the end is a smaller set
find "$out/cases" -mindepth 1 -maxdepth 1 -type d ! -name robots -printf '%f\n' | sed 's/\(.*\)_\([0-9]*\)$/\2 \1_\2/' | sort |
  cut -d' ' -f2 | ARMCAL_BUILD=$build xargs -P "$(nproc)" -I{} bash -c 'one {}'
status=0
"$build/tests/judged/judged_score" "$out/cases" "$out/verdicts" "$out/score.json" "${shares[@]}" | tee "$out/score.txt" || status=$?
if [[ $part == report* && $percent -ge 100 ]]; then
  commit=$(git -C "$here" describe --always --dirty)
  printf '%s\t%s\t%s\t%s\t%s\n' "$(date -u +%F)" "$part" "$seed" "$commit" "$(tr -s ' \n' ' ;' <"$out/score.txt")" >>"$here/reports.tsv"
fi
exit "$status"
