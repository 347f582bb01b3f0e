#!/usr/bin/env bash
# tests - flags of other people: lib and two models, one of them of one joint, under warnings that the project does not ask for; what a
# compiler must refuse, and how; and what contraction ends in.
#   foreign_flags.sh CHECKOUT
set -euo pipefail
checkout=$1
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
bad=0
fail() { echo "$*: FAILED"; bad=1; }

warnings="-Wall -Wextra -Wpedantic -Wconversion -Wsign-conversion -Wdouble-promotion -Wshadow -Wold-style-cast -Werror"
exact="-ffp-contract=off -fno-math-errno"
cat >"$work/all.cpp" <<'END'
#include "armcal/armcal.hpp"
#include "model.hpp"
using Model = armcal::generated::MODEL;
using namespace armcal::filter;
template class armcal::controller::Controller<Model, ForgettingFilter<Model>>;
template class armcal::controller::Controller<Model, KalmanFilter<Model>, KalmanFilter<Model, Form::kBlock>>;
template class armcal::controller::Controller<Model, ExtendedKalmanFilter<Model>>;  // neither model has an eta
END
cat >"$work/no_links.cpp" <<'END'
#include "armcal/armcal.hpp"
#include "tests/unit/estimator/two_link_model.hpp"
struct NoLinks : armcal::test::TwoLink {
  static constexpr int kRigid = 0, kDense = 0, kColumns = kFront;
};
armcal::estimator::AdoptedTable<NoLinks> table;
armcal::estimator::Estimator<NoLinks, armcal::filter::ForgettingFilter<NoLinks>> estimator;
END

for compiler in g++ clang++; do
  if ! command -v $compiler >/dev/null; then
    echo "$compiler is not there: left out"
    continue
  fi
  for language in c++17 gnu++17 c++20; do
    for model in er20_like:Er20Like emps:Emps; do
      $compiler -std=$language $exact $warnings -DMODEL="${model#*:}" -I"$checkout/lib" -I"$checkout/codegen/generated/${model%:*}" \
        -fsyntax-only "$work/all.cpp" || fail "$compiler -std=$language ${model%:*}"
    done
  done
  # What cannot be compiled ends in one sentence.
  if $compiler -std=c++17 $exact -Wpedantic -Werror -I"$checkout" -I"$checkout/lib" -fsyntax-only "$work/no_links.cpp" 2>"$work/log"; then
    fail "$compiler takes a model without links"
  fi
  grep -q "a model has at least one base parameter of its links" "$work/log" || fail "$compiler does not say why"
  [[ $(grep -c "error:" "$work/log") == 1 ]] || fail "$compiler says more than that: $(cat "$work/log")"
  # A host that has the instruction: with the compiler's defaults the firmware adopts no table, with -ffp-contract=off it does.
  grep -qw fma /proc/cpuinfo || continue
  for flags in "-std=gnu++17" "-std=c++17" "-std=gnu++17 -ffp-contract=off"; do
    $compiler -O2 -mfma $flags -I"$checkout" -I"$checkout/lib" "$checkout/tests/target/negative/default_flags.cpp" \
      "$checkout/port/runner/linux.cpp" -o "$work/firmware"
    wanted=24
    [[ $flags == *off ]] && wanted=0
    ("$work/firmware" || true) | grep -qx "table $wanted" || fail "$compiler $flags: not table $wanted"
  done
done
exit $bad
