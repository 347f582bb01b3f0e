// client - names the ways in which talking to a drive fails.
#pragma once

#include <stdexcept>
#include <string>

#include "armcal/core/status.hpp"

namespace armcal::client {

// There is no answer, or one that makes no sense. The tool exits with 3.
struct LinkError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

// The link was lost after the drive was told to take a table. Whether it has done so is unknown.
struct SentError : LinkError {
  using LinkError::LinkError;
};

// Ctrl-C ended the work. The tool exits with 130, as a shell expects it.
struct InterruptedError : LinkError {
  using LinkError::LinkError;
};

// The drive refused. `status` is its reason, or kOk if it gave none. The tool exits with 4.
struct RefusedError : std::runtime_error {
  RefusedError(const std::string& what, int exception_code, core::Status reason)
      : std::runtime_error(what), exception(exception_code), status(reason) {}
  int exception;  // Modbus exception code, 0 if the refusal came later
  core::Status status;
};

// What was read back is not what was written. The tool exits with 5.
struct VerifyError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

}  // namespace armcal::client
