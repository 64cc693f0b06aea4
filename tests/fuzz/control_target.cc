// SPDX-License-Identifier: Apache-2.0
// Requests on the command socket, and their way into the log.
#include <spdlog/sinks/base_sink.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <memory>
#include <mutex>

#include "daemon/system/control_socket.h"
#include "daemon/system/service_log.h"
#include "ipc/printable.h"
#include "tests/fuzz/targets.h"

namespace farpoint::fuzz {
namespace {

// Demands lines that no text can forge.
class LinesOnly final : public spdlog::sinks::base_sink<std::mutex> {
 protected:
  void sink_it_(const spdlog::details::log_msg& message) override {
    require(ipc::is_printable_line({message.payload.data(), message.payload.size()}),
            "a log message is one line");
  }
  void flush_() override {}
};

std::string socket_path() {
  return "/tmp/farpoint_fuzz_" + std::to_string(getpid()) + ".socket";
}

int connected_to(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  path.copy(address.sun_path, sizeof address.sun_path - 1);
  const int fd = socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0);
  require(fd >= 0 && connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0,
          "the command socket answers");
  return fd;
}

}  // namespace

void run_control(ByteView input) {
  static daemon::ControlSocket control(socket_path());
  static const auto sink = std::make_shared<LinesOnly>();
  const int client = connected_to(socket_path());
  (void)send(client, input.data(), input.size(), MSG_NOSIGNAL);
  control.serve([](const std::string& command) {
    const std::string text = "command: " + command;
    daemon::hand_on_one_line({"", spdlog::level::info, text}, sink.get());
    return "ok " + command;
  });
  close(client);
}

std::vector<Bytes> seeds_of_control() {
  return {bytes_of("status"), bytes_of("reset-odom"), bytes_of("stop"), bytes_of("a\n<0>b\x1b[2J")};
}

}  // namespace farpoint::fuzz
