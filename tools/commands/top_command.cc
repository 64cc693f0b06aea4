// SPDX-License-Identifier: Apache-2.0
#include <lcm/lcm.h>
#include <poll.h>
#include <termios.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <csignal>
#include <cstdio>
#include <ctime>
#include <memory>
#include <span>

#include "ipc/channels.h"
#include "tools/commands/commands.h"
#include "tools/common/errors.h"
#include "tools/top/board.h"

namespace farpoint::tools {
namespace {

struct TopOptions {
  std::string url = ipc::kDefaultLcmUrl;
  double seconds = 0;  // 0: until it is interrupted
  bool plain = false;
};

volatile std::sig_atomic_t interrupted = 0;

double steady_s() {
  timespec t{};
  clock_gettime(CLOCK_MONOTONIC, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

template <typename Message>
void take(const lcm_recv_buf_t* buffer, const char* /*channel*/, void* user) {
  auto* board = static_cast<Board*>(user);
  Message message{};
  const std::span bytes(static_cast<const std::uint8_t*>(buffer->data), buffer->data_size);
  if (ipc::decode(bytes, &message)) {
    board->take(message, steady_s());
  } else {
    board->take_undecodable();
  }
}

// Keys of a terminal, one by one and not echoed; the terminal is restored in the end. Without a terminal
// there are no keys.
class Keyboard {
 public:
  explicit Keyboard(bool in_use) {
    if (!in_use || isatty(STDIN_FILENO) != 1 || tcgetattr(STDIN_FILENO, &before_) != 0) return;
    termios keys = before_;
    keys.c_lflag &= ~static_cast<tcflag_t>(ICANON | ECHO);  // signals of Ctrl-C and Ctrl-Z stay
    is_open_ = tcsetattr(STDIN_FILENO, TCSANOW, &keys) == 0;
  }
  ~Keyboard() {
    if (is_open_) tcsetattr(STDIN_FILENO, TCSANOW, &before_);
  }
  Keyboard(const Keyboard&) = delete;
  Keyboard& operator=(const Keyboard&) = delete;

  // For poll(), which ignores the -1 of no keys.
  [[nodiscard]] int descriptor() const { return is_open_ && !at_end_ ? STDIN_FILENO : -1; }
  // True if one of the keys that were pressed is 'q'.
  [[nodiscard]] bool read_quit() {
    std::array<char, 64> keys{};
    const ssize_t got = read(STDIN_FILENO, keys.data(), keys.size());
    at_end_ = got <= 0;
    return std::any_of(keys.begin(), keys.begin() + std::max<ssize_t>(got, 0),
                       [](char key) { return key == 'q' || key == 'Q'; });
  }

 private:
  termios before_{};
  bool is_open_ = false, at_end_ = false;
};

// The network until it is destroyed.
class Listener {
 public:
  Listener(const std::string& url, Board* board) : lcm_(lcm_create(url.c_str())) {
    if (lcm_ == nullptr) {
      throw RunError("cannot listen on " + url +
                     ", expected an LCM URL and a multicast route (ip route add 239.255.76.67/32 dev lo)");
    }
    lcm_subscribe(lcm_, ipc::kOdometryChannel, take<odometry_t>, board);
    lcm_subscribe(lcm_, ipc::kStatusChannel, take<status_t>, board);
    lcm_subscribe(lcm_, ipc::kTimingChannel, take<timing_t>, board);
  }
  ~Listener() { lcm_destroy(lcm_); }
  Listener(const Listener&) = delete;
  Listener& operator=(const Listener&) = delete;

  // Handles what comes within the time; ends early when 'q' is pressed.
  void listen(int milliseconds, Keyboard* keyboard) {
    for (double until_s = steady_s() + 1e-3 * milliseconds, now_s = steady_s();
         now_s < until_s && interrupted == 0; now_s = steady_s()) {
      std::array descriptors = {pollfd{lcm_get_fileno(lcm_), POLLIN, 0},
                                pollfd{keyboard->descriptor(), POLLIN, 0}};
      if (poll(descriptors.data(), descriptors.size(), static_cast<int>(1e3 * (until_s - now_s)) + 1) <= 0)
        continue;
      if ((descriptors[0].revents & POLLIN) != 0) lcm_handle(lcm_);
      if (descriptors[1].revents != 0 && keyboard->read_quit()) interrupted = 1;
    }
  }

 private:
  lcm_t* lcm_;
};

int run_top(const TopOptions& options) {
  constexpr int kRefresh_ms = 200;
  const bool terminal = isatty(STDOUT_FILENO) == 1 && !options.plain;
  Keyboard keyboard(terminal);
  Board board;
  Listener listener(options.url, &board);
  std::signal(SIGINT, [](int) { interrupted = 1; });
  std::signal(SIGTERM, [](int) { interrupted = 1; });
  const double began_s = steady_s();
  do {
    listener.listen(kRefresh_ms, &keyboard);
    if (!terminal) continue;
    // From the upper left corner over the picture before; what is left of that is wiped.
    std::printf("\x1b[H\x1b[2J%s\nq: leave\n", board.render(steady_s(), true).c_str());
    std::fflush(stdout);
  } while (interrupted == 0 && (options.seconds <= 0.0 || steady_s() - began_s < options.seconds));
  if (!terminal) std::fputs(board.render(steady_s(), false).c_str(), stdout);
  return kExitDone;
}

}  // namespace

void add_top_command(CLI::App* app, Action* action) {
  auto options = std::make_shared<TopOptions>();
  CLI::App* command = app->add_subcommand("top", "State, rates, latencies and health of a running farpointd");
  command->add_option("--lcm-url", options->url, "Where it publishes (key lcm.url)")
      ->type_name("URL")
      ->capture_default_str();
  command->add_option("--seconds", options->seconds, "Leave after so long, and print the last picture")
      ->type_name("S")
      ->check(CLI::Range(0.0, 1e6));
  command->add_flag("--plain", options->plain, "No terminal codes: only the last picture");
  command->footer(
      "Examples:\n"
      "  farpoint top\n"
      "  farpoint top --seconds 2 --plain      (for a script)\n"
      "q leaves. All of it comes from LCM: FARPOINT_STATUS, FARPOINT_ODOMETRY and FARPOINT_TIMING. Rates, "
      "latencies and\n"
      "CPU are of the last five seconds. reason: why the state is not tracking. sigma: size of the standard "
      "deviation,\n"
      "a dash where the daemon gives none. points: landmarks with a depth, of all maps; virtual points have "
      "none "
      "yet.\n"
      "CAN off: no bus is in use.");
  command->callback([options, action] { *action = [options] { return run_top(*options); }; });
}

}  // namespace farpoint::tools
