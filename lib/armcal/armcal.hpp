// armcal - the entry of the library: what it is, who may call it when, ten lines of use, and where to go on.
//
// armcal estimates the dynamic parameters of a robot arm inside the arm's motion controller: base inertial parameters,
// friction, and whatever effects the model has. It needs positions and measured currents of all joints at one instant.
// It also computes the torque to feed forward at a set-point. Feed-forward and estimation start from a parameter table
// that a client stores over Modbus. An estimate never becomes torque by itself: somebody reads it, checks it and stores
// it as a new table. The library uses C++17, float32 and no heap, and throws no exception.
//
// A firmware has three contexts. The comment of a file, a class or a function names the context that may call it
// ("Context: ..."). If a function names none, that of its class holds. Functions that only compute may be called from
// any context.
//   tick              an interrupt, usually every millisecond: FeedForward, then Push. Bounded time, whatever is
//                     measured. It never waits.
//   serial interrupt  your driver moves bytes between the line and its rings. It calls nothing of the library.
//   background        everything else, in slices of bounded length. The two interrupts may stop a slice anywhere.
//
// Use. `storage`, `clock` and `serial` are yours; port/PORTING.md says what they must do. README.md has this as a whole
// program.
//
//   using Model = armcal::generated::SelectedModel;          // the generator makes it from a robot file
//   using Filter = armcal::filter::ForgettingFilter<Model>;  // or another filter, or two of them
//   armcal::controller::Controller<Model, Filter> controller(storage, clock);
//   armcal::link::RtuService modbus(controller.engine(), serial, clock, unit, silence_ms);
//
//   controller.SetEnabledAxes(axes);                                // in the tick
//   status = controller.FeedForward(set, temperature_degC, tau_Nm);
//   status = controller.Push(raw);
//
//   status = controller.Boot();                                     // in the background
//   for (;;) { modbus.Poll(); if (!controller.Step()) Sleep(); }
//
// Where to go on:
//   model/sample.hpp               what the tick hands over, and what becomes of it
//   controller/controller.hpp      all calls of the lines above
//   estimator/estimator.hpp        one filter without the rest: samples in, estimates out
//   filter/*_filter.hpp            the filters, and what each is good for
//   feedforward/feed_forward.hpp   the torque alone
//   model/contract.hpp             what a generated model consists of
//   core/status.hpp                the answer of each call that can be refused
// DESIGN.md says why things are as they are, SPEC.md has every bit on the wire and in storage.
#pragma once

// GCC's -Wsign-conversion names each array whose length is an int of a template.
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wsign-conversion"
#endif
#include "armcal/controller/controller.hpp"
#include "armcal/filter/forgetting_filter.hpp"
#include "armcal/filter/kalman_filter.hpp"
#include "armcal/link/rtu.hpp"
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC diagnostic pop
#endif
