#!/usr/bin/env bash
# leaderboard - makes cases, runs armcal and its rivals on them, scores all in the same way.
#   tests/leaderboard/leaderboard.sh [SEED [OUT_DIR [PERCENT [RIVAL...]]]]
# PERCENT scales the number of cases of the judged set's report2. RIVAL: programs in the place of all in rivals/.
# OUT_DIR/cases holds what a rival gets, OUT_DIR/truth the rest. OUT_DIR/cases.tar.gz is what one may hand on. Verdicts and scores have folders of their own. The table is
# OUT_DIR/leaderboard.md and leaderboard.json.
# Builds what it needs in build/host. With ARMCAL_BUILD it takes that build folder as it is (targets armcal, practice_robot,
# judged_set, judged_score). pip installs the rivals into build/peers/leaderboard.
set -euo pipefail

here=$(realpath "$(dirname "${BASH_SOURCE[0]}")")
root=$(realpath "$here/../..")
if [[ -z ${ARMCAL_BUILD:-} ]]; then
  ARMCAL_BUILD=$root/build/host
  bash "$root/toolchains/install.sh" host tests peers
  (cd "$root" && cmake --preset host >/dev/null && cmake --build --preset host --target armcal practice_robot judged_set judged_score -j 2 >/dev/null)
fi
ARMCAL_BUILD=$(realpath "$ARMCAL_BUILD")
export ARMCAL_BUILD
seed=${1:-77} out=$(realpath -m "${2:-$root/build/leaderboard}") percent=${3:-2}
rivals=("${@:4}")
[[ ${#rivals[@]} -gt 0 ]] || rivals=("$here"/rivals/*)
groups="controls_plain 60 controls_slow 70 controls_quiet 70 controls_late 70 controls_stamps 40 singles_ii 420 unrecorded 110 several 70"

venv=$root/build/peers/leaderboard
if ! cmp -s "$here/requirements.txt" "$venv/installed.txt"; then
  python3 -m venv "$venv"
  "$venv/bin/pip" install -q --disable-pip-version-check -r "$here/requirements.txt"
  cp "$here/requirements.txt" "$venv/installed.txt"
fi

rm -rf "$out" && mkdir -p "$out/truth"
# shellcheck disable=SC2086
printf '%s %s\n' $groups | while read -r group count; do
  "$ARMCAL_BUILD/tests/judged/judged_set" "$out/cases" "$seed" "$group" $(((count * percent + 99) / 100)) report 0
done
mv "$out/cases/robots" "$out/robots"
robot=$(mktemp --suffix=.toml)
trap 'rm -f "$robot"' EXIT
for one in "$out"/cases/*; do
  mkdir "$out/truth/$(basename "$one")" && mv "$one/truth.json" "$out/truth/$(basename "$one")"
  cp "$out/robots/$(sed -n 's/.*"robot": "\(.*\)".*/\1/p' "$one/case.json").json" "$one/robot.json"
  "$ARMCAL_BUILD/tests/practice/practice_robot" "$one" "$out/robots" >"$robot"
  "$ARMCAL_BUILD/armcal" export --robot "$robot" --format mjcf -o "$one/arm.xml" >/dev/null
done
# What one may hand on: the cases without their truth, how to take part, and the licence.
"$ARMCAL_BUILD/armcal" --version >"$out/version.txt"
tar -czf "$out/cases.tar.gz" --transform "s,^,armcal_cases_$seed/," -C "$out" cases robots version.txt -C "$root" LICENSE -C docs leaderboard.md
rm "$out/version.txt"
# One core each, so that the seconds can be compared.
export OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1
"$venv/bin/python" "$here/leaderboard.py" "$out" "$ARMCAL_BUILD/tests/judged/judged_score" "$seed" "${rivals[@]}"
