// SPDX-License-Identifier: Apache-2.0
#include "tests/live/live_program.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <linux/can.h>
#include <poll.h>
#include <sys/ptrace.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <csignal>
#include <cstring>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string_view>
#include <utility>

#include "tests/support/paths.h"

namespace farpoint::test {
namespace {

double now_s() {
  timespec t{};
  clock_gettime(CLOCK_MONOTONIC, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

int listen_at(const std::string& path, int type) {
  const int fd = socket(AF_UNIX, type | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  path.copy(address.sun_path, sizeof(address.sun_path) - 1);
  EXPECT_EQ(bind(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  if ((type & SOCK_SEQPACKET) == SOCK_SEQPACKET) {
    EXPECT_EQ(listen(fd, 4), 0);
  }
  return fd;
}

int exit_status(pid_t child) {
  int status = 0;
  waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
}

}  // namespace

LiveProgram::LiveProgram()
    : dbc_(read_dbc(source_dir() + "/config/farpoint.dbc")),
      listening_(listen_at(scratch_.path("bus"), SOCK_SEQPACKET)),
      notices_(listen_at(scratch_.path("notify"), SOCK_DGRAM)) {}

LiveProgram::~LiveProgram() {
  if (program_ > 0) (void)stop(SIGKILL);
  for (const int fd : {listening_, bus_, notices_})
    if (fd >= 0) close(fd);
}

void LiveProgram::start(const std::vector<std::string>& settings, const std::vector<std::string>& arguments) {
  std::vector<std::string> words = {binary_dir() + "/bin/farpointd"};
  std::vector<std::string> all = {"can.enabled=true",           "can.interface=fakecan0",
                                  "lcm.enabled=false",          "control.socket=none",
                                  "realtime.lock_memory=false", "state.folder=" + scratch_.path(".")};
  all.insert(all.end(), settings.begin(), settings.end());
  for (const std::string& setting : all) {
    words.emplace_back("--set");
    words.push_back(setting);
  }
  words.insert(words.end(), arguments.begin(), arguments.end());
  const std::string said = scratch_.path("said.txt"), library = binary_dir() + "/lib/farpoint_fake_bus.so";
  const std::string bus = scratch_.path("bus"), notify = scratch_.path("notify");
  program_ = fork();
  if (program_ != 0) return;
  const int out = open(said.c_str(), O_WRONLY | O_CREAT | O_APPEND, 0644);
  dup2(out, STDOUT_FILENO);
  dup2(out, STDERR_FILENO);
  setenv("LD_PRELOAD", library.c_str(), 1);
  setenv("FARPOINT_FAKE_BUS", bus.c_str(), 1);
  setenv("NOTIFY_SOCKET", notify.c_str(), 1);
  setenv("WATCHDOG_USEC", "500000", 1);
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  execv(argv[0], argv.data());
  _exit(127);
}

bool LiveProgram::run_until(const std::function<bool()>& enough, double limit_s) {
  const double end_s = now_s() + limit_s;
  while (!enough()) {
    if (now_s() > end_s) return false;
    std::array<pollfd, 3> waited = {pollfd{listening_, POLLIN, 0}, pollfd{bus_, POLLIN, 0},
                                    pollfd{notices_, POLLIN, 0}};
    (void)poll(waited.data(), waited.size(), 10);
    take_bus();
    take_notices();
  }
  return true;
}

void LiveProgram::run_for(double duration_s) {
  (void)run_until([] { return false; }, duration_s);
}

void LiveProgram::take_bus() {
  if (const int fd = accept4(listening_, nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC); fd >= 0) {
    if (bus_ >= 0) close(bus_);
    bus_ = fd;
  }
  can_frame in{};
  while (bus_ >= 0 && read(bus_, &in, sizeof in) == static_cast<ssize_t>(sizeof in)) {
    (void)!send(bus_, &in, sizeof in, MSG_NOSIGNAL | MSG_DONTWAIT);  // confirmed
    const auto message = dbc_.find(in.can_id);
    if (message == dbc_.end() || message->second.name != "FARPOINT_STATUS") continue;
    ipc::CanFrame frame;
    frame.id = in.can_id;
    std::copy_n(in.data, in.len, frame.data.begin());
    const auto value = [&](const char* name) { return message->second.signals.at(name).value(frame); };
    epochs_.push_back(
        {now_s(), value("State"), value("Age"), value("BootCounter"), value("PoseValid") != 0.0});
  }
}

void LiveProgram::take_notices() {
  std::array<char, 512> text{};
  for (ssize_t got = 0; (got = recv(notices_, text.data(), text.size(), 0)) > 0;)
    if (std::string_view(text.data(), static_cast<std::size_t>(got)).starts_with("WATCHDOG=1"))
      fed_s_.push_back(now_s());
}

int LiveProgram::stop(int signal) {
  release();
  kill(program_, signal);
  const pid_t program = std::exchange(program_, -1);
  if (signal == SIGKILL) return exit_status(program);
  // What it says at its end is taken too.
  siginfo_t info{};
  (void)run_until([&] {
    info.si_pid = 0;
    return waitid(P_PID, static_cast<id_t>(program), &info, WEXITED | WNOHANG | WNOWAIT) == 0 &&
           info.si_pid == program;
  });
  take_bus();
  return exit_status(program);
}

pid_t LiveProgram::thread_of(const std::string& name) const {
  const std::string tasks = "/proc/" + std::to_string(program_) + "/task";
  for (const auto& task : std::filesystem::directory_iterator(tasks)) {
    std::ifstream file(task.path() / "comm");
    std::string comm;
    if (std::getline(file, comm) && comm == name) return std::stoi(task.path().filename().string());
  }
  ADD_FAILURE() << "no thread " << name;
  return -1;
}

void LiveProgram::hold(const std::string& thread) {
  held_ = thread_of(thread);
  ASSERT_EQ(ptrace(PTRACE_SEIZE, held_, nullptr, nullptr), 0) << std::strerror(errno);
  ASSERT_EQ(ptrace(PTRACE_INTERRUPT, held_, nullptr, nullptr), 0);
  int status = 0;
  ASSERT_EQ(waitpid(held_, &status, __WALL), held_);
}

void LiveProgram::release() {
  if (held_ < 0) return;
  (void)ptrace(PTRACE_DETACH, std::exchange(held_, -1), nullptr, nullptr);
}

std::string LiveProgram::said() const {
  std::ifstream file(scratch_.path("said.txt"));
  return {std::istreambuf_iterator<char>(file), {}};
}

}  // namespace farpoint::test
