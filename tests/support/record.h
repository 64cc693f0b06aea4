// SPDX-License-Identifier: Apache-2.0
// Figures of a test for machines: `--gtest_output=json:FILE` writes them beside the test's result.
#pragma once

#include <gtest/gtest.h>

#include <cstdio>
#include <string>

namespace farpoint::test {

// GoogleTest records whole numbers and text only.
inline void record_number(const std::string& key, double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.10g", value);
  testing::Test::RecordProperty(key, text);
}

}  // namespace farpoint::test
