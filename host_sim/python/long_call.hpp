// python - runs a long call so that other Python threads run, its caller sees how far it is, and Ctrl-C ends it.
#pragma once

#include <nanobind/nanobind.h>

#include <functional>

#include "codegen/src/io/watch.hpp"

namespace armcal::python {

// progress: None, or a callable that takes the share done; called by this thread only, and at the end with 1. What it
// raises ends the call and is passed on, and so is the KeyboardInterrupt of Ctrl-C. ValueError: it is no callable.
template <class Work>
void RunLongCall(nanobind::handle progress, const Work& work) {
  if (!progress.is_none() && PyCallable_Check(progress.ptr()) == 0)
    throw nanobind::value_error("progress: expected a callable that takes a number, or None");
  const auto look = [progress](double share) {
    const nanobind::gil_scoped_acquire held;
    if (PyErr_CheckSignals() != 0) throw nanobind::python_error();
    if (!progress.is_none()) progress(share);
  };
  {
    const io::Watch watch(look);
    const nanobind::gil_scoped_release others_run;
    work();
  }
  look(1);
}

}  // namespace armcal::python
