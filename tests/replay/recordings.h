// SPDX-License-Identifier: Apache-2.0
// Recordings of the data folder through the project's programs.
#pragma once

#include <cstdlib>
#include <filesystem>
#include <string>
#include "tests/support/paths.h"

namespace farpoint::test {

inline const std::filesystem::path kData =
    std::filesystem::path(test::source_dir()) / ".." / "shared" / "data";
inline const std::filesystem::path kBin = std::filesystem::path(test::binary_dir()) / "bin";

// Settings of a run with one camera and nothing else, so that a figure is the camera's: one line a sensor.
inline const std::string kOneCameraAlone = " --set camera.use=one --set wheels.use=false";

// Status of a shell command; what it prints goes to this test's output.
inline int run(const std::string& command) {
  const int status = std::system(command.c_str());
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

// `text` with the data folder in the place of {}.
inline std::string with_data(std::string text) {
  const std::size_t at = text.find("{}");
  return at == std::string::npos ? text : text.replace(at, 2, kData.string());
}

// Imports a recording as `file`: `arguments` of farpoint import, {} stands for the data folder. False where
// it fails.
inline bool import_recording(const std::string& arguments, const std::string& file) {
  return run((kBin / "farpoint").string() + " import " + with_data(arguments) + " -o " + file) == 0;
}

}  // namespace farpoint::test
