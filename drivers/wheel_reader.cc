#include "drivers/wheel_reader.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

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

WheelReader::WheelReader(const std::string& dbc_path, const std::string& names) {
  for (std::size_t begin = 0; begin <= names.size();) {
    const std::size_t end = std::min(names.find(',', begin), names.size());
    const std::string name = trimmed(names.substr(begin, end - begin));
    begin = end + 1;
    const std::size_t dot = name.find('.');
    if (dot == std::string::npos || dot == 0 || dot + 1 == name.size())
      throw std::runtime_error("wheel signal '" + name + "', expected MESSAGE.SIGNAL");
    Wheel wheel;
    wheel.signal = ipc::read_dbc_signal(dbc_path, name.substr(0, dot), name.substr(dot + 1));
    wheel.to_m_s = factor_of(name, wheel.signal.unit);
    wheels_.push_back(std::move(wheel));
  }
  if (wheels_.size() > kMaxWheels)
    throw std::runtime_error(std::to_string(wheels_.size()) + " wheel signals, expected one to four");
}

bool WheelReader::take(const ipc::CanFrame& frame, std::int64_t utime, wheels_t* message) {
  for (Wheel& wheel : wheels_) {
    if (wheel.signal.id != frame.id) continue;
    wheel.speed_m_s = wheel.to_m_s * wheel.signal.value(frame);
    wheel.heard = true;
  }
  if (!std::all_of(wheels_.begin(), wheels_.end(), [](const Wheel& w) { return w.heard; })) return false;
  give(utime, message);
  for (Wheel& wheel : wheels_) wheel.heard = false;
  return true;
}

void WheelReader::give(std::int64_t utime, wheels_t* message) const {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  message->utime = utime;
  message->speed_sigma = -1.0;
  message->yaw_rate = message->steering_angle = kNan;
  message->nwheels = static_cast<std::int32_t>(wheels_.size());
  message->wheel_speed.resize(wheels_.size());
  double sum = 0.0;
  int known = 0;
  for (std::size_t i = 0; i < wheels_.size(); ++i) {
    message->wheel_speed[i] = wheels_[i].speed_m_s;
    if (std::isnan(wheels_[i].speed_m_s)) continue;
    sum += wheels_[i].speed_m_s;
    ++known;
  }
  message->speed = known > 0 ? sum / known : kNan;
}

std::vector<std::uint32_t> WheelReader::ids() const {
  std::vector<std::uint32_t> ids;
  for (const Wheel& wheel : wheels_)
    if (std::find(ids.begin(), ids.end(), wheel.signal.id) == ids.end()) ids.push_back(wheel.signal.id);
  return ids;
}

}  // namespace farpoint::drivers
