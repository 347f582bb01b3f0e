// io - the one exception that means bad input.
#pragma once

#include <stdexcept>
#include <string>

namespace armcal::io {

// One line for the user: file, line or key, what was expected. The command line tool prints it and exits with 2.
struct InputError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

}  // namespace armcal::io
