// SPDX-License-Identifier: Apache-2.0
#include "tools/common/child_process.h"

#include <fcntl.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>

#include "tools/common/errors.h"

namespace farpoint::tools {

namespace {

constexpr off_t kComplaintBytes = 64 << 10;

// A parent that ignores SIGCHLD hands that down; waitpid() then has no status of any child.
void keep_exit_statuses() {
  struct sigaction action {};
  if (sigaction(SIGCHLD, nullptr, &action) == 0 && action.sa_handler == SIG_IGN) signal(SIGCHLD, SIG_DFL);
}

}  // namespace

ChildProcess::ChildProcess(std::vector<std::string> arguments, const std::string& package)
    : error_fd_(memfd_create("standard error", MFD_CLOEXEC | MFD_ALLOW_SEALING)) {
  keep_exit_statuses();
  std::vector<char*> argv;
  argv.reserve(arguments.size() + 1);
  for (std::string& argument : arguments) argv.push_back(argument.data());
  argv.push_back(nullptr);
  std::array<int, 2> pipe_fds{};
  // A sealed file does not grow: what the child says beyond that is lost.
  if (error_fd_ < 0 || ftruncate(error_fd_, kComplaintBytes) != 0 ||
      fcntl(error_fd_, F_ADD_SEALS, F_SEAL_GROW | F_SEAL_SHRINK) != 0 ||
      pipe2(pipe_fds.data(), O_CLOEXEC) != 0) {
    const std::string why = std::strerror(errno);
    if (error_fd_ >= 0) close(error_fd_);
    throw RunError(arguments[0] + ": cannot be started (" + why + ")");
  }
  output_fd_ = pipe_fds[0];
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_adddup2(&actions, pipe_fds[1], STDOUT_FILENO);
  posix_spawn_file_actions_adddup2(&actions, error_fd_, STDERR_FILENO);
  const int error = posix_spawnp(&pid_, argv[0], &actions, nullptr, argv.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  close(pipe_fds[1]);
  if (error == 0) return;
  pid_ = -1;
  close(output_fd_);
  close(error_fd_);
  throw InputError(arguments[0] + ": cannot be started (" + std::strerror(error) +
                   "), expected the package " + package);
}

ChildProcess::~ChildProcess() {
  close(output_fd_);
  if (pid_ > 0) {
    kill(pid_, SIGKILL);
    (void)wait();
  }
  close(error_fd_);
}

std::size_t ChildProcess::read(std::span<char> buffer) {
  std::size_t done = 0;
  while (done < buffer.size()) {
    const ssize_t got = ::read(output_fd_, buffer.data() + done, buffer.size() - done);
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) break;
    done += static_cast<std::size_t>(got);
  }
  return done;
}

int ChildProcess::wait() {
  if (pid_ <= 0) return -1;
  int status = 0;
  pid_t ended = waitpid(pid_, &status, 0);
  while (ended < 0 && errno == EINTR) ended = waitpid(pid_, &status, 0);
  pid_ = -1;
  return ended > 0 && WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

std::string ChildProcess::complaint() const {
  constexpr off_t kMostBytes = 4096;
  const off_t size = lseek(error_fd_, 0, SEEK_CUR);  // the child writes at the same offset
  const off_t begin = size > kMostBytes ? size - kMostBytes : 0;
  std::string text(static_cast<std::size_t>(size > 0 ? size - begin : 0), '\0');
  const ssize_t got = pread(error_fd_, text.data(), text.size(), begin);
  text.resize(static_cast<std::size_t>(got > 0 ? got : 0));
  while (!text.empty() && (text.back() == '\n' || text.back() == '\r')) text.pop_back();
  const std::size_t line = text.find_last_of("\r\n");
  return line == std::string::npos ? text : text.substr(line + 1);
}

}  // namespace farpoint::tools
