// SPDX-License-Identifier: Apache-2.0
#include <spdlog/fmt/fmt.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <fstream>

#include "ipc/printable.h"
#include "tools/bugreport/bugreport.h"
#include "tools/common/child_process.h"
#include "tools/common/errors.h"
#include "tools/common/text_file.h"

namespace farpoint::tools {
namespace {

constexpr std::size_t kBlock = 64 << 10;

// The end of a stream of bytes.
class Tail {
 public:
  void add(std::span<const char> bytes) {
    text_.append(bytes.data(), bytes.size());
    if (text_.size() > 2 * Collection::kMostBytes) cut();
  }
  // With a first line where bytes are missing.
  std::string take() {
    if (text_.size() > Collection::kMostBytes) cut();
    return left_out_ == 0 ? std::move(text_)
                          : fmt::format("[{} bytes before this are left out]\n", left_out_) + text_;
  }

 private:
  void cut() {
    const std::size_t more = text_.size() - Collection::kMostBytes;
    text_.erase(0, more);
    left_out_ += more;
  }

  std::string text_;
  std::size_t left_out_ = 0;
};

std::string joined(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : " ") + word;
  return text;
}

}  // namespace

Collection::Collection(std::filesystem::path folder) : folder_(std::move(folder)) {
  std::error_code error;
  std::filesystem::create_directories(folder_, error);
  if (error) throw RunError(folder_.string() + ": cannot be made (" + error.message() + ")");
}

void Collection::add_text(const std::string& name, const std::string& from, std::string text) {
  const std::filesystem::path file = folder_ / name;
  std::error_code ignored;
  std::filesystem::create_directories(file.parent_path(), ignored);
  write_file(file.string(), text);
  taken_.push_back(fmt::format("{:<28} {}", name, ipc::printable(from)));
}

void Collection::add_file(const std::string& name, const std::filesystem::path& source) {
  std::ifstream in(source, std::ios::binary);
  std::error_code ignored;
  if (!in || std::filesystem::is_directory(source, ignored))
    return add_missing(name, source.string() + ": " + (in ? "a folder" : std::strerror(errno)));
  Tail tail;
  std::array<char, kBlock> block{};
  while (in.read(block.data(), block.size()) || in.gcount() > 0)
    tail.add({block.data(), static_cast<std::size_t>(in.gcount())});
  add_text(name, source.string(), tail.take());
}

void Collection::add_output(const std::string& name, std::vector<std::string> command,
                            const std::string& package) {
  const std::string shown = joined(command);
  std::vector<std::string> bounded = {"timeout", std::to_string(kLongest_s)};
  bounded.insert(bounded.end(), command.begin(), command.end());
  try {
    ChildProcess child(bounded, "coreutils");
    Tail tail;
    std::array<char, kBlock> block{};
    while (const std::size_t got = child.read(block)) tail.add({block.data(), got});
    const int status = child.wait();
    std::string text = tail.take();
    const std::string ended = status == 0 ? "" : fmt::format(" (status {}) {}", status, child.complaint());
    if (text.empty() && status == 0) text = "nothing is printed\n";
    if (!text.empty()) return add_text(name, shown + ended, std::move(text));
    constexpr int kNotFound = 127;
    add_missing(name, shown + (status == kNotFound ? ": is not installed, expected the package " + package
                                                   : ":" + ended));
  } catch (const std::runtime_error& error) {
    add_missing(name, shown + ": " + error.what());
  }
}

void Collection::add_missing(const std::string& name, const std::string& why) {
  missing_.push_back(name + ": " + ipc::printable(why));
}

void Collection::write_list(const std::string& head) {
  std::string text = head + "\nTaken\n";
  for (const std::string& line : taken_) text += "  " + line + "\n";
  text += "\nNot read\n";
  for (const std::string& line : missing_) text += "  " + line + "\n";
  if (missing_.empty()) text += "  nothing\n";
  write_file((folder_ / "contents.txt").string(), text);
}

}  // namespace farpoint::tools
