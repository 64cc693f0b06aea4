// SPDX-License-Identifier: Apache-2.0
// Input that cannot be used.
#pragma once

#include <stdexcept>

namespace farpoint::daemon {

// what() is one line with what, where and what was expected. Exit status 2.
class InputError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace farpoint::daemon
