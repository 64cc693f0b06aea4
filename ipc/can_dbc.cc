// SPDX-License-Identifier: Apache-2.0
#include "ipc/can_dbc.h"

#include <array>
#include <charconv>
#include <cmath>
#include <vector>

namespace farpoint::ipc {
namespace {

constexpr std::uint32_t kExtendedFlag = 0x80000000;  // of an identifier in a DBC file
constexpr int kTimeoutCycles = 5;

// A signal as one message of the file has it.
struct Signal {
  const char* name;
  unsigned start, length;
  bool is_signed;
  double factor, min, max;
  const char* unit;
  std::int64_t at_start;
  const char* values;
  std::string comment;
};

struct Message {
  std::uint32_t id;
  const char* name;
  std::string comment;
  std::size_t size;
  int cycle_ms;
  int e2e_profile;
  unsigned data_id;
  std::vector<Signal> signals;
};

// The shortest text that reads back to the same number.
std::string shortest(double value) {
  std::array<char, 64> buffer{};
  const auto result =
      std::to_chars(buffer.data(), buffer.data() + buffer.size(), value, std::chars_format::fixed);
  return {buffer.data(), result.ptr};
}

Signal signal_of(const CanSignalInfo& info, unsigned start) {
  return {info.name,     start,       info.length, info.kind == CanSignalKind::kSigned,
          info.step,     info.min,    info.max,    info.unit,
          info.at_start, info.values, info.comment};
}

int cycle_ms(const CanLayout& layout, int divider) {
  constexpr double kMsPerSecond = 1e3;
  return static_cast<int>(std::lround(kMsPerSecond * divider / layout.rate_hz));
}

std::uint32_t file_id(const CanLayout& layout, std::uint32_t id) {
  return layout.extended ? id | kExtendedFlag : id;
}

Message classic_message(const CanLayout& layout, CanMessage message) {
  const int divider = layout.period_of(message);
  Message out{file_id(layout, layout.id(message)),
              name_of(message),
              comment_of(message),
              8,
              cycle_ms(layout, divider),
              1,
              layout.data_id(message),
              {}};
  out.signals = {
      {"CRC", 0, 8, false, 1, 0, 255, "", 0, "",
       "AUTOSAR E2E profile 1: CRC-8 0x1D over Data ID low byte, high byte, then bytes 1..7; start 0, XOR "
       "0."},
      {"Counter", 8, 4, false, 1, 0, 14, "", 0, "",
       "Goes on by one each time this frame is sent, 0..14. Frames that go out with every epoch carry the "
       "same."},
      {"AgeCoarse", 12, 4, false, 0.01, 0, 0.13, "s", 15, "14 \"more than 0.13 s\" 15 \"not available\"",
       "Age as in the status frame, for those who read this frame alone. The pose is predicted to the time "
       "of "
       "sending already."}};
  for (const CanSignalInfo& info : can_signals())
    if (info.message == message) out.signals.push_back(signal_of(info, info.start));
  return out;
}

Message fd_message(const CanLayout& layout) {
  Message out{file_id(layout, layout.base_id),
              "FARPOINT_EPOCH",
              "All of an epoch in one CAN FD frame.",
              kCanFdBytes,
              cycle_ms(layout, 1),
              5,
              layout.fd_data_id(),
              {}};
  out.signals = {{"CRC", 0, 16, false, 1, 0, 65535, "", 0, "",
                  "AUTOSAR E2E profile 5: CRC-16 0x1021, start 0xFFFF, over bytes 2..63, then Data ID low "
                  "byte, high byte."},
                 {"Counter", 16, 8, false, 1, 0, 255, "", 0, "", "Goes on by one a frame, 0..255."}};
  for (const CanSignalInfo& info : can_signals()) out.signals.push_back(signal_of(info, info.fd_start()));
  return out;
}

std::vector<Message> messages_of(const CanLayout& layout) {
  if (layout.fd) return {fd_message(layout)};
  std::vector<Message> out;
  for (std::size_t i = 0; i < kCanMessages; ++i) {
    const auto message = static_cast<CanMessage>(i);
    if (layout.period_of(message) > 0) out.push_back(classic_message(layout, message));
  }
  return out;
}

std::string head() {
  return "VERSION \"farpoint " + std::to_string(kCanLayoutNumber) +
         "\"\n\nNS_ :\n\tCM_\n\tBA_DEF_\n\tBA_\n\tVAL_\n\tBA_DEF_DEF_\n\nBS_:\n\nBU_: FARPOINT CONTROLLER\n";
}

std::string definition(const Message& message) {
  std::string text = "\nBO_ " + std::to_string(message.id) + " " + message.name + ": " +
                     std::to_string(message.size) + " FARPOINT\n";
  for (const Signal& s : message.signals) {
    text += std::string(" SG_ ") + s.name + " : " + std::to_string(s.start) + "|" + std::to_string(s.length) +
            "@1" + (s.is_signed ? "-" : "+") + " (" + shortest(s.factor) + ",0) [" + shortest(s.min) + "|" +
            shortest(s.max) + "] \"" + s.unit + "\" CONTROLLER\n";
  }
  return text;
}

std::string comments(const std::vector<Message>& messages) {
  std::string text =
      "\nCM_ BU_ FARPOINT \"Visual odometry. One clock sends epochs at a steady rate, whatever happens to "
      "images, "
      "with the pose predicted to the time of sending. Body axes: x forward, y left, z up. A signal with its "
      "not "
      "available value must not be used. Where nothing came for GenMsgTimeoutTime, the last values must not "
      "be "
      "used.\";\n";
  for (const Message& m : messages) {
    text += "CM_ BO_ " + std::to_string(m.id) + " \"" + m.comment + "\";\n";
    for (const Signal& s : m.signals) {
      if (!s.comment.empty())
        text += "CM_ SG_ " + std::to_string(m.id) + " " + s.name + " \"" + s.comment + "\";\n";
    }
  }
  return text;
}

std::string attribute(const char* name, const Message& message, int value) {
  return std::string("BA_ \"") + name + "\" BO_ " + std::to_string(message.id) + " " + std::to_string(value) +
         ";\n";
}

std::string attributes(const CanLayout& layout, const std::vector<Message>& messages) {
  std::string text =
      "\nBA_DEF_ \"BusType\" STRING ;\n"
      "BA_DEF_ BO_ \"VFrameFormat\" ENUM "
      "\"StandardCAN\",\"ExtendedCAN\",\"reserved\",\"J1939PG\",\"reserved\","
      "\"reserved\",\"reserved\",\"reserved\",\"reserved\",\"reserved\",\"reserved\",\"reserved\","
      "\"reserved\","
      "\"reserved\",\"StandardCAN_FD\",\"ExtendedCAN_FD\";\n"
      "BA_DEF_ BO_ \"GenMsgCycleTime\" INT 0 65535;\n"
      "BA_DEF_ BO_ \"GenMsgTimeoutTime\" INT 0 65535;\n"
      "BA_DEF_ BO_ \"E2EProfile\" INT 0 65535;\n"
      "BA_DEF_ BO_ \"E2EDataId\" INT 0 65535;\n"
      "BA_DEF_ SG_ \"GenSigStartValue\" INT -2147483648 2147483647;\n"
      "BA_DEF_DEF_ \"BusType\" \"CAN\";\n"
      "BA_DEF_DEF_ \"VFrameFormat\" \"StandardCAN\";\n"
      "BA_DEF_DEF_ \"GenMsgCycleTime\" 0;\n"
      "BA_DEF_DEF_ \"GenMsgTimeoutTime\" 0;\n"
      "BA_DEF_DEF_ \"E2EProfile\" 1;\n"
      "BA_DEF_DEF_ \"E2EDataId\" 0;\n"
      "BA_DEF_DEF_ \"GenSigStartValue\" 0;\n";
  text += std::string("BA_ \"BusType\" \"") + (layout.fd ? "CAN FD" : "CAN") + "\";\n";
  const int format = (layout.fd ? 14 : 0) + (layout.extended ? 1 : 0);
  for (const Message& m : messages) {
    text += attribute("VFrameFormat", m, format);
    text += attribute("GenMsgCycleTime", m, m.cycle_ms);
    text += attribute("GenMsgTimeoutTime", m, kTimeoutCycles * m.cycle_ms);
    text += attribute("E2EProfile", m, m.e2e_profile);
    text += attribute("E2EDataId", m, static_cast<int>(m.data_id));
  }
  for (const Message& m : messages) {
    for (const Signal& s : m.signals) {
      if (s.at_start == 0) continue;
      text += std::string("BA_ \"GenSigStartValue\" SG_ ") + std::to_string(m.id) + " " + s.name + " " +
              std::to_string(s.at_start) + ";\n";
    }
  }
  return text;
}

std::string value_tables(const std::vector<Message>& messages) {
  std::string text = "\n";
  for (const Message& m : messages) {
    for (const Signal& s : m.signals) {
      if (*s.values != '\0') text += "VAL_ " + std::to_string(m.id) + " " + s.name + " " + s.values + " ;\n";
    }
  }
  return text;
}

}  // namespace

std::string dbc_text(const CanLayout& layout) {
  const std::vector<Message> messages = messages_of(layout);
  std::string text = head();
  for (const Message& message : messages) text += definition(message);
  return text + comments(messages) + attributes(layout, messages) + value_tables(messages);
}

}  // namespace farpoint::ipc
