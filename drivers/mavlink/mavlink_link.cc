// SPDX-License-Identifier: Apache-2.0
#include "drivers/mavlink/mavlink_link.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <optional>
#include <system_error>
#include <vector>

namespace farpoint::drivers {
namespace {

constexpr int kMostPort = 65535;

struct Speed {
  int baud;
  speed_t code;
};
constexpr std::array kSpeeds = {Speed{9600, B9600},       Speed{19200, B19200},     Speed{38400, B38400},
                                Speed{57600, B57600},     Speed{115200, B115200},   Speed{230400, B230400},
                                Speed{460800, B460800},   Speed{500000, B500000},   Speed{576000, B576000},
                                Speed{921600, B921600},   Speed{1000000, B1000000}, Speed{1500000, B1500000},
                                Speed{2000000, B2000000}, Speed{3000000, B3000000}};

const Speed* find_speed(int baud) {
  const auto* const speed =
      std::find_if(kSpeeds.begin(), kSpeeds.end(), [baud](const Speed& s) { return s.baud == baud; });
  return speed == kSpeeds.end() ? nullptr : speed;
}

std::optional<int> whole_number(const std::string& text) {
  int value = 0;
  const auto result = std::from_chars(text.data(), text.data() + text.size(), value);
  if (result.ec != std::errc() || result.ptr != text.data() + text.size()) return std::nullopt;
  return value;
}

std::optional<int> port_of(const std::string& text) {
  const std::optional<int> port = whole_number(text);
  return port && *port > 0 && *port <= kMostPort ? port : std::nullopt;
}

std::vector<std::string> parts_of(const std::string& text) {
  std::vector<std::string> parts(1);
  for (const char c : text) {
    if (c == ':')
      parts.emplace_back();
    else
      parts.back() += c;
  }
  return parts;
}

// A device's name may hold colons (/dev/serial/by-path): the last one ends it.
std::optional<MavlinkAddress> serial_address(const std::string& text) {
  const std::size_t colon = text.rfind(':');
  if (colon == std::string::npos || colon == 0) return std::nullopt;
  const std::optional<int> baud = whole_number(text.substr(colon + 1));
  if (!baud || find_speed(*baud) == nullptr) return std::nullopt;
  return MavlinkAddress{true, text.substr(0, colon), *baud, 0};
}

std::optional<MavlinkAddress> udp_address(const std::string& text) {
  const std::vector<std::string> parts = parts_of(text);
  if (parts.size() != 2 && parts.size() != 3) return std::nullopt;
  in_addr numbers{};
  const std::optional<int> port = port_of(parts[1]);
  if (inet_pton(AF_INET, parts[0].c_str(), &numbers) != 1 || !port) return std::nullopt;
  MavlinkAddress address{false, parts[0], *port, 0};
  if (parts.size() == 2) return address;
  const std::optional<int> local = port_of(parts[2]);
  if (!local) return std::nullopt;
  address.local_port = *local;
  return address;
}

std::optional<MavlinkAddress> parse_address(const std::string& text) {
  static const std::string udp = "udp:", serial = "serial:";
  if (text.starts_with(udp)) return udp_address(text.substr(udp.size()));
  if (text.starts_with(serial)) return serial_address(text.substr(serial.size()));
  return std::nullopt;
}

sockaddr_in socket_address(in_addr_t host, int port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = host;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  return address;
}

// errno, or 0.
int set_up_udp(int fd, const MavlinkAddress& address) {
  if (address.local_port > 0) {
    const sockaddr_in local = socket_address(htonl(INADDR_ANY), address.local_port);
    if (::bind(fd, reinterpret_cast<const sockaddr*>(&local), sizeof(local)) != 0) return errno;
  }
  in_addr numbers{};
  inet_pton(AF_INET, address.host.c_str(), &numbers);
  const sockaddr_in remote = socket_address(numbers.s_addr, address.port);
  return ::connect(fd, reinterpret_cast<const sockaddr*>(&remote), sizeof(remote)) != 0 ? errno : 0;
}

// Eight bits, no parity, one stop bit, no flow control, no translation.
int set_up_serial(int fd, int baud) {
  termios settings{};
  if (tcgetattr(fd, &settings) != 0) return errno;
  cfmakeraw(&settings);
  settings.c_cflag |= CLOCAL | CREAD;
  settings.c_cflag &= ~static_cast<tcflag_t>(CRTSCTS | CSTOPB);
  settings.c_cc[VMIN] = 0;
  settings.c_cc[VTIME] = 0;
  const speed_t code = find_speed(baud)->code;
  if (cfsetispeed(&settings, code) != 0 || cfsetospeed(&settings, code) != 0) return errno;
  return tcsetattr(fd, TCSANOW, &settings) != 0 ? errno : 0;
}

}  // namespace

std::string MavlinkAddress::check(const std::string& text) {
  if (parse_address(text)) return {};
  return "expected udp:ADDRESS:PORT, udp:ADDRESS:PORT:LOCAL_PORT (IPv4 numbers) or serial:DEVICE:BAUD, like "
         "serial:/dev/ttyS1:921600";
}

MavlinkAddress MavlinkAddress::parse(const std::string& text) {
  return parse_address(text).value_or(MavlinkAddress{});
}

std::string MavlinkLink::open() {
  if (is_open()) return {};
  const int fd = address_.is_serial
                     ? ::open(address_.host.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC)
                     : ::socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  int error = fd < 0 ? errno : 0;
  if (error == 0) error = address_.is_serial ? set_up_serial(fd, address_.port) : set_up_udp(fd, address_);
  if (error != 0) {
    counts_.last_errno = error;
    if (fd >= 0) ::close(fd);
    return std::generic_category().message(error);
  }
  fd_ = fd;
  if (was_open_) ++counts_.reopened;
  was_open_ = true;
  return {};
}

void MavlinkLink::close() {
  if (fd_ >= 0) ::close(fd_);
  fd_ = -1;
}

// A UDP port without a listener is an error of the next call only: the socket stays. A serial device that is
// gone has to be opened anew.
void MavlinkLink::note_failure(int error) {
  counts_.last_errno = error;
  if (address_.is_serial && error != EAGAIN && error != EINTR) close();
}

bool MavlinkLink::send(std::span<const std::uint8_t> message) {
  if (is_open()) {
    const ssize_t written = address_.is_serial ? ::write(fd_, message.data(), message.size())
                                               : ::send(fd_, message.data(), message.size(), MSG_NOSIGNAL);
    if (written == static_cast<ssize_t>(message.size())) {
      ++counts_.sent;
      return true;
    }
    // A part of a message in a full serial buffer is damaged at the receiver, which finds the next one.
    note_failure(written < 0 ? errno : EAGAIN);
  }
  ++counts_.not_sent;
  return false;
}

std::span<const std::uint8_t> MavlinkLink::receive(std::span<std::uint8_t> room) {
  if (!is_open()) return {};
  const ssize_t count = ::read(fd_, room.data(), room.size());
  if (count > 0) return room.first(static_cast<std::size_t>(count));
  if (count < 0 && errno != EAGAIN && errno != EINTR) note_failure(errno);
  return {};
}

}  // namespace farpoint::drivers
