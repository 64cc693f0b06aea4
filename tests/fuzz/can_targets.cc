// SPDX-License-Identifier: Apache-2.0
// DBC files, frames from the vehicle's bus, and lines of CAN logs.
#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "drivers/can/wheel_reader.h"
#include "ipc/can_codec.h"
#include "ipc/candump.h"
#include "ipc/dbc.h"
#include "tests/fuzz/memory_file.h"
#include "tests/fuzz/targets.h"

namespace farpoint::fuzz {
namespace {

constexpr std::string_view kWheels =
    "BO_ 291 FRONT: 8 ABS\n"
    " SG_ LEFT : 7|16@0+ (0.01,0) [0|655] \"km/h\" X\n"
    " SG_ RIGHT : 16|12@1- (0.05,-3) [-50|50] \"m/s\" X\n"
    "BO_ 292 REAR: 64 ABS\n"
    " SG_ LEFT : 0|64@1+ (1,0) [0|0] \"m/s\" X\n"
    " SG_ RIGHT : 500|9@1- (0.001,0) [0|0] \"kph\" X\n";

// A frame of an input: identifier (two bytes), length, data.
std::size_t take_frame(ByteView input, ipc::CanFrame* frame) {
  constexpr std::size_t kHead = 3;
  if (input.size() < kHead) return 0;
  frame->id = static_cast<std::uint32_t>(input[0] << 8 | input[1]) & ipc::kMaxStandardCanId;
  frame->size = static_cast<std::uint8_t>(std::min<std::size_t>(input[2] % 65, input.size() - kHead));
  std::copy_n(input.begin() + kHead, frame->size, frame->data.begin());
  return kHead + frame->size;
}

}  // namespace

void run_dbc(ByteView input) {
  try {
    const ipc::DbcSignal signal = ipc::parse_dbc_signal(text_of(input), "x.dbc", "FRONT", "LEFT");
    require(signal.id <= ipc::kMaxStandardCanId && signal.length >= 1 && signal.length <= 64,
            "a signal is sound");
    ipc::CanFrame frame;
    for (const double value : {0.0, -1.0, 1e300, -1e300, 3.14, std::nan("")}) {
      frame.size = static_cast<std::uint8_t>(signal.size);
      frame.id = signal.id;
      (void)signal.put(value, &frame);
      require(!std::isinf(signal.value(frame)), "a value is a number or 'not available'");
    }
  } catch (const std::runtime_error&) {  // refused
  }
}

void run_can(ByteView input) {
  static const MemoryFile dbc(
      ByteView(reinterpret_cast<const std::uint8_t*>(kWheels.data()), kWheels.size()));
  static drivers::WheelReader reader(dbc.path(), "FRONT.LEFT, FRONT.RIGHT, REAR.LEFT, REAR.RIGHT");
  wheels_t wheels;
  ipc::CanFrame frame;
  std::int64_t utime = 0;
  for (ByteView rest = input; const std::size_t used = take_frame(rest, &frame); rest = rest.subspan(used)) {
    if (!reader.take(frame, ++utime, &wheels)) continue;
    require(wheels.nwheels == 4 && wheels.utime == utime, "a measurement has all wheels");
    for (const double speed : wheels.wheel_speed)
      require(!std::isinf(speed), "a speed is a number or unknown");
  }
  ipc::CandumpLine line;
  const std::string text = text_of(input);
  if (ipc::parse_candump_line(text, &line))
    require(line.frame.size <= 64, "a frame of a CAN log has a length");
}

std::vector<Bytes> seeds_of_dbc() {
  return {bytes_of(kWheels),
          bytes_of("VERSION \"\"\nBO_ 2047 FRONT: 8 X\n SG_ LEFT : 63|64@0- (1e-3,+5) [-1|1] \"km/h\" V\n")};
}

std::vector<Bytes> seeds_of_can() {
  Bytes frames;
  const auto add = [&](int id, int size) {
    frames.insert(frames.end(), {static_cast<std::uint8_t>(id >> 8), static_cast<std::uint8_t>(id),
                                 static_cast<std::uint8_t>(size)});
    for (int i = 0; i < size; ++i) frames.push_back(static_cast<std::uint8_t>(7 * i));
  };
  add(291, 8);
  add(292, 64);
  add(291, 3);
  return {frames, bytes_of("(1700000000.123456) can0 680#0011223344556677"),
          bytes_of("(0.000001) vcan0 00000680##100112233445566778899AABBCCDDEEFF")};
}

}  // namespace farpoint::fuzz
