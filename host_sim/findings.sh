#!/usr/bin/env bash
# What the models of three measured arms lack: the tables and pictures of docs/findings.md about these arms.
#   ARMCAL_DATA=FOLDER bash host_sim/findings.sh [OUT [PICTURES]]     default: build/findings, pictures beside the rest
# FOLDER holds measured/emps, measured/kuka_kr300 and measured/kuka_lwr4. ARMCAL: the tool (default: build/host/armcal).
set -euo pipefail
cd "$(dirname "$0")/.."
data=${ARMCAL_DATA:?the folder that holds the measured logs}/measured
out=${1:-build/findings}
pictures=${2:-$out}
rm -rf "$out"/{emps,kuka_kr300,kuka_lwr4,kuka_lwr4_free}  # pictures of another time
mkdir -p "$out" "$pictures"

# splits NAME SET ROBOT RUNS...: runs of one trajectory are joined by commas.
splits() {
  local name=$1 set=$2 robot=$3
  shift 3
  echo "== $name"
  "${ARMCAL:-build/host/armcal}" diagnose --robot "$robot" --channels "host_sim/data/channels/$set.toml" \
    --out "$out/$name" --json "$out/$name.json" --report "$out/$name.html" --splits "$@"
  for picture in "$out/$name"/*.svg; do cp "$picture" "$pictures/${name}_$(basename "$picture")"; done
}

kr=$data/kuka_kr300/run lwr=$data/kuka_lwr4/measurements
splits emps emps emps "$data"/emps/emps_{ident,pulses}.csv.gz
splits kuka_kr300 kuka_kr300 kuka_kr300 "$kr"_{A,B,C}.csv.gz
# Runs 1 and 2 repeat one trajectory. Once with the link data of the robot file, once with every body free.
lwr_runs=("${lwr}_1.csv.gz,${lwr}_2.csv.gz" "${lwr}_3.csv.gz")
splits kuka_lwr4 kuka_lwr4 kuka_lwr4 "${lwr_runs[@]}"
sed 's/^tick_rate_Hz/prior = "none"\n&/' codegen/robots/kuka_lwr4.toml >"$out/kuka_lwr4_free.toml"
splits kuka_lwr4_free kuka_lwr4 "$out/kuka_lwr4_free.toml" "${lwr_runs[@]}"

# A torque over q7 declared in the robot file: what a model with it predicts better, and what worse.
echo "== kuka_lwr4: RMS error of each joint, held out, without and with a torque over q7 (armcal identify)"
curve='[[effect]]
name = "position_torque"
state = "estimated"
joints = [7]
nonlinear = { lo = -1.27, hi = 1.27 }'
errors() {  # ROBOT HELD_OUT TRAIN...
  "${ARMCAL:-build/host/armcal}" identify --robot "$1" --channels host_sim/data/channels/kuka_lwr4.toml \
    --train "${@:3}" --test "${lwr}_$2.csv.gz" |
    awk -v what="run $2, $(basename "$1" .toml):" '/^ +[1-7] /{ what = what " " $4 } END { print what }'
}
for model in codegen/robots/kuka_lwr4.toml "$out/kuka_lwr4_free.toml"; do
  with="$out/$(basename "$model" .toml)_q7.toml"
  { cat "$model"; printf '\n%s\n' "$curve"; } >"$with"
  for robot in "$model" "$with"; do
    for run in 1 2; do errors "$robot" $run "${lwr}_3.csv.gz"; done
    errors "$robot" 3 "${lwr}"_{1,2}.csv.gz
  done
done

echo "== kuka_lwr4: do the joints move apart? Correlation of positions with joint 7 and with joint 5"
for run in 1 3; do
  gzip -dc "${lwr}_$run.csv.gz" | awk -F, -v run="$run" '
    NR > 1 { n++; for (i = 2; i <= 8; i++) { s[i] += $i; for (j = 2; j <= 8; j++) p[i, j] += $i * $j } }
    function c(i, j) { return p[i, j] / n - s[i] * s[j] / n / n }
    END { for (k = 8; k >= 6; k -= 2) { printf "run %d, joint %d:", run, k - 1
      for (i = 2; i <= 8; i++) printf " %.2f", c(i, k) / sqrt(c(i, i) * c(k, k)); print "" } }'
done
