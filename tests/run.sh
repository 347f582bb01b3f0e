#!/usr/bin/env bash
# tests - builds armcal and runs its tests; sets up whatever it needs.
#   tests/run.sh fast   host build, unit and property tests
#   tests/run.sh [all]    + end-to-end tests, planted faults, firmware and wire tests under sanitizers, both Cortex-M images and their
#                         tests under QEMU
#   tests/run.sh long     + the long tests, all planted faults, all fast tests under sanitizers, fuzzing
#   tests/run.sh peers  alone: comparisons with other people's programs, which pip installs into build/peers; the report in a browser
# The last line is "N passed, M failed"; a CTest test, a build and a check count one each.
set -uo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

scope=${1:-all}
case $scope in
  fast) labels='^fast$' ;;
  all) labels='^(fast|all)$' ;;
  long) labels='^(fast|all|long)$' ;;
  peers) labels= ;;
  *) sed -n '2,8p' "$0" >&2; exit 2 ;;
esac

jobs=$(nproc)
((jobs > 2)) && jobs=2
passed=0
failed=0
log=$(mktemp)
trap 'rm -f "$log"' EXIT

say() { echo "== $*"; }
finish() { echo "$passed passed, $failed failed"; exit $((failed > 0)); }

# step NAME COMMAND...: one thing that can pass or fail; its output is shown only when it fails.
step() {
  local name=$1 start=$SECONDS
  shift
  if "$@" >"$log" 2>&1; then
    passed=$((passed + 1))
    say "$name: ok ($((SECONDS - start)) s)"
  else
    failed=$((failed + 1))
    tail -n 60 "$log"
    say "$name: FAILED"
    return 1
  fi
}

# run_ctest NAME BUILD_FOLDER LABELS [TESTS]: adds CTest's own counts.
run_ctest() {
  local name=$1 start=$SECONDS results=$2/Testing/results.xml
  rm -f "$results"
  # One more than there are cores: a test that waits for a drive leaves a core idle.
  ctest --test-dir "$2" -L "$3" -R "${4:-.}" -j $((jobs + 1)) --output-on-failure --no-tests=error --output-junit Testing/results.xml \
    --test-output-size-passed 1000000 >"$log" 2>&1
  local status=$? total bad absent skipped
  count() { grep -om1 "\b$1=\"[0-9]*\"" "$results" 2>/dev/null | tr -dc 0-9; }
  total=$(count tests)
  bad=$(count failures)
  absent=$(count skipped)
  if [[ -z $total || -z $bad ]] || ((status != 0 && bad == 0)); then total=1 bad=1; fi
  passed=$((passed + total - bad - ${absent:-0}))
  failed=$((failed + bad))
  skipped=$(sed -n 's/.*<testcase name="\([^"]*\)".*status="notrun".*/\1/p' "$results" 2>/dev/null | tr '\n' ' ')
  [[ -z $skipped ]] || say "skipped tests: $skipped"
  skipped=$(sed -n 's/^\[  SKIPPED \] \([A-Za-z0-9_.\/]*\) (.*/\1/p' "$results" 2>/dev/null | sort -u | tr '\n' ' ')
  [[ -z $skipped ]] || say "skipped inside tests: $skipped"
  if ((bad > 0)); then
    tail -n 200 "$log"
    say "$name: $bad of $total FAILED"
  else
    say "$name: $total ok ($((SECONDS - start)) s)"
  fi
}

configure_and_build() { cmake --preset "$1" && cmake --build --preset "$1" -j "$jobs" "${@:2}"; }

step "host packages" toolchains/install.sh host tests || finish

if [[ $scope == peers ]]; then
  peers_programs() { python3 -m venv build/peers/venv && build/peers/venv/bin/pip install -q --disable-pip-version-check -r tests/peers/requirements.txt; }
  step "peers packages" toolchains/install.sh peers || finish
  step "other people's programs" peers_programs || finish
  step "build armcal" configure_and_build host --target armcal armcal-generate armcal_analysis practice_robot judged_set judged_score || finish
  step "exports in MuJoCo, Pinocchio and libsdformat" build/peers/venv/bin/python tests/peers/exports_test.py build/host/armcal build/peers/exports
  step "excitations in MuJoCo" build/peers/venv/bin/python tests/peers/collisions_test.py build/host/armcal build/peers/collisions
  step "arms of public collections" build/peers/venv/bin/python tests/peers/arms_test.py build/host/armcal build/peers/arms
  step "logs by other people's libraries" build/peers/venv/bin/python tests/peers/logs_test.py build/host/armcal build/peers/logs
  python_package() { build/peers/venv/bin/pip install -q --disable-pip-version-check --config-settings "cmake.define.ARMCAL_BUILT=$PWD/build/host" ./host_sim/python; }
  step "the Python package" python_package || finish
  step "its regressor and Pinocchio" build/peers/venv/bin/python tests/peers/python_test.py build/host/armcal build/peers/python
  step "its long calls and its example" build/peers/venv/bin/python tests/peers/python_calls_test.py build/host/armcal build/peers/python_calls
  step "packages of Conan, colcon, PlatformIO and Zephyr" build/peers/venv/bin/python tests/peers/packages_test.py . build/peers/packages
  if step "docs packages" toolchains/install.sh docs; then step "the site" cmake --build --preset host --target docs_site; fi
  step "the page about TLS" tests/docs/follow.sh docs/tls.md build/peers/tls build/host/armcal
  step "the leaderboard" python3 tests/leaderboard/leaderboard_test.py build/peers/leaderboard_test
  step "the report in a browser" build/peers/venv/bin/python tests/peers/report_test.py build/host/armcal build/peers/report
  finish
fi

if [[ -z ${ARMCAL_DATA:-} && -d ../shared/data ]]; then
  ARMCAL_DATA=$(cd ../shared/data && pwd)
fi
if [[ -n ${ARMCAL_DATA:-} && -d $ARMCAL_DATA ]]; then
  export ARMCAL_DATA
  say "measured logs: $ARMCAL_DATA"
else
  say "no measured logs (ARMCAL_DATA is not set): tests on them are skipped"
fi

say "building build/host"
programs=(all)
if [[ $scope == long ]]; then
  programs+=(long_tests)
  step "fleet packages" toolchains/install.sh fleet
  step "packages for a fresh Debian" toolchains/install.sh fresh
fi
step "build host" configure_and_build host --target "${programs[@]}" || finish
run_ctest "tests ($scope)" build/host "$labels"

if [[ $scope != fast ]]; then
  step "cross packages" toolchains/install.sh cross
  on_board='^target$'
  [[ $scope == long ]] && on_board='^(target|long)$'
  for image in cortex-m4f cortex-m7; do
    if step "image $image" configure_and_build "$image"; then
      run_ctest "target tests $image" "build/$image" "$on_board"
      cat "build/$image/budgets.txt"
    fi
  done

  # Under sanitizers: what bytes from outside reach and what runs on the target. Matrix code takes long to compile so. So the filters and
  # their loops are run by the programs of the boards here; their unit tests, and the host's matrix code, come with `long`.
  rooms=(core signal physical monitor feedforward table link controller client files bags logs port_template)
  programs=(elementary kernels filters)
  targets=("${rooms[@]/#/test_}" "${programs[@]/#/bits_}")
  tests="^($(IFS='|'; echo "${rooms[*]/#/test_}|${programs[*]/#/sanitized_}"))$"
  if [[ $scope == long ]]; then
    targets=(fast_tests)
    tests='^test_'
  fi
  say "building tests with sanitizers"
  if step "build host-asan" configure_and_build host-asan --target "${targets[@]}"; then
    run_ctest "tests with sanitizers" build/host-asan '^fast$' "$tests"
  fi
fi
if [[ $scope == long ]]; then
  if step "fuzz packages" toolchains/install.sh fuzz; then step "fuzz targets, 60 s each" tests/fuzz/fuzz.sh 60; fi
fi
[[ $scope == fast ]] || say "not run: tests/run.sh peers (comparisons with other people's programs, the report in a browser)"
finish
