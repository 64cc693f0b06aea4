// SPDX-License-Identifier: Apache-2.0
#include "drivers/can/wheel_signals.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

namespace farpoint::drivers {
namespace {

constexpr std::size_t kMaxWheels = 4;
constexpr double kMetresPerSecond_per_km_h = 1.0 / 3.6;

std::string trimmed(const std::string& text) {
  const std::size_t begin = text.find_first_not_of(' ');
  if (begin == std::string::npos) return "";
  return text.substr(begin, text.find_last_not_of(' ') - begin + 1);
}

double factor_of(const std::string& name, const std::string& unit) {
  if (unit == "m/s") return 1.0;
  if (unit == "km/h" || unit == "kph") return kMetresPerSecond_per_km_h;
  throw std::runtime_error("wheel signal " + name + " has the unit '" + unit + "', expected m/s or km/h");
}

}  // namespace

std::vector<WheelSignal> read_wheel_signals(const std::string& dbc_path, const std::string& names) {
  std::vector<WheelSignal> signals;
  for (std::size_t begin = 0; begin <= names.size();) {
    const std::size_t end = std::min(names.find(',', begin), names.size());
    const std::string name = trimmed(names.substr(begin, end - begin));
    begin = end + 1;
    const std::size_t dot = name.find('.');
    if (dot == std::string::npos || dot == 0 || dot + 1 == name.size())
      throw std::runtime_error("wheel signal '" + name + "', expected MESSAGE.SIGNAL");
    WheelSignal signal;
    signal.dbc = ipc::read_dbc_signal(dbc_path, name.substr(0, dot), name.substr(dot + 1));
    signal.to_m_s = factor_of(name, signal.dbc.unit);
    signals.push_back(std::move(signal));
  }
  if (signals.size() > kMaxWheels)
    throw std::runtime_error(std::to_string(signals.size()) + " wheel signals, expected one to four");
  return signals;
}

}  // namespace farpoint::drivers
