// Recordings of the data folder through the project's programs.
#pragma once

#include <cstdlib>
#include <filesystem>
#include <string>

namespace farpoint::test {

inline const std::filesystem::path kData =
    std::filesystem::path(FARPOINT_SOURCE_DIR) / ".." / "shared" / "data";
inline const std::filesystem::path kBin = std::filesystem::path(FARPOINT_BINARY_DIR) / "bin";

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

// A folder of this name for one test, empty at first and gone at its end.
class WorkFolder {
 public:
  explicit WorkFolder(const std::string& name)
      : path_(std::filesystem::temp_directory_path() / ("farpoint_" + name)) {
    std::filesystem::remove_all(path_);
    std::filesystem::create_directories(path_);
  }
  ~WorkFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  WorkFolder(const WorkFolder&) = delete;
  WorkFolder& operator=(const WorkFolder&) = delete;
  [[nodiscard]] std::string file(const std::string& name) const { return (path_ / name).string(); }

 private:
  std::filesystem::path path_;
};

}  // namespace farpoint::test
