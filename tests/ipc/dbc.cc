// SPDX-License-Identifier: Apache-2.0
#include "tests/ipc/dbc.h"

#include <gtest/gtest.h>

#include <array>
#include <cstdio>
#include <fstream>
#include <limits>
#include <string_view>

namespace farpoint::test {
namespace {

// Not std::regex: GCC 12 warns of its insides under the sanitizers.

using Name = std::array<char, 128>;

bool read_message(const char* line, std::uint32_t* id, DbcMessage* out) {
  Name name;
  if (std::sscanf(line, "BO_ %u %127[A-Za-z0-9_]: %u %*s", id, name.data(), &out->size) != 3) return false;
  out->name = name.data();
  return true;
}

bool read_signal(const char* line, std::string* name, DbcSignal* out) {
  Name text, unit{};
  char sign = 0;
  const int read = std::sscanf(line, " SG_ %127[A-Za-z0-9_] : %u|%u@1%c (%lf,%lf) [%lf|%lf] \"%127[^\"]\"",
                               text.data(), &out->start, &out->length, &sign, &out->factor, &out->offset,
                               &out->min, &out->max, unit.data());
  if (read < 8 || (sign != '+' && sign != '-')) return false;  // an empty unit is not counted
  *name = text.data();
  out->is_signed = sign == '-';
  out->unit = unit.data();
  return true;
}

bool read_values(const char* line, std::uint32_t* id, std::string* name,
                 std::map<std::int64_t, std::string>* values) {
  Name text;
  int used = 0;
  if (std::sscanf(line, "VAL_ %u %127[A-Za-z0-9_] %n", id, text.data(), &used) != 2) return false;
  *name = text.data();
  line += used;
  long long raw = 0;
  while (std::sscanf(line, " %lld \"%127[^\"]\"%n", &raw, text.data(), &used) == 2) {
    (*values)[raw] = text.data();
    line += used;
  }
  return std::string_view(line).find_first_not_of(" ;") == std::string_view::npos;
}

bool read_start_value(const char* line, std::uint32_t* id, std::string* name, int* number) {
  Name text;
  if (std::sscanf(line, "BA_ \"GenSigStartValue\" SG_ %u %127[A-Za-z0-9_] %d;", id, text.data(), number) != 3)
    return false;
  *name = text.data();
  return true;
}

void set_attribute(std::string_view attribute, int number, DbcMessage* message) {
  if (attribute == "E2EDataId") message->data_id = number;
  if (attribute == "E2EProfile") message->e2e_profile = number;
  if (attribute == "GenMsgCycleTime") message->cycle_ms = number;
  if (attribute == "GenMsgTimeoutTime") message->timeout_ms = number;
  if (attribute == "VFrameFormat") message->frame_format = number;
}

}  // namespace

std::uint32_t dbc_id(const ipc::CanFrame& frame) {
  return frame.extended ? frame.id | 0x80000000U : frame.id;
}

std::int64_t DbcSignal::raw(const ipc::CanFrame& frame) const {
  std::int64_t out = 0;
  for (unsigned i = 0; i < length; ++i) {  // Intel order: bit by bit
    const unsigned bit = start + i;
    if ((frame.data.at(bit / 8) >> (bit % 8) & 1) != 0) out |= std::int64_t{1} << i;
  }
  const bool is_negative = is_signed && (out >> (length - 1) & 1) != 0;
  return is_negative ? out - (std::int64_t{1} << length) : out;
}

double DbcSignal::value(const ipc::CanFrame& frame) const {
  const auto known = values.find(raw(frame));
  if (known != values.end() && known->second == "not available")
    return std::numeric_limits<double>::quiet_NaN();
  return static_cast<double>(raw(frame)) * factor + offset;
}

std::map<std::uint32_t, DbcMessage> read_dbc(const std::string& path) {
  std::map<std::uint32_t, DbcMessage> out;
  std::ifstream file(path);
  EXPECT_TRUE(file) << path;
  std::uint32_t present = 0;  // the message whose signals follow
  for (std::string line; std::getline(file, line);) {
    DbcMessage message;
    DbcSignal signal;
    std::string name;
    std::uint32_t id = 0;
    Name attribute;
    int number = 0;
    if (line.starts_with("BO_ ")) {
      EXPECT_TRUE(read_message(line.c_str(), &present, &message)) << line;
      EXPECT_TRUE(out.emplace(present, message).second) << "twice: " << line;
    } else if (line.starts_with(" SG_ ")) {
      EXPECT_TRUE(read_signal(line.c_str(), &name, &signal)) << line;
      EXPECT_TRUE(out.at(present).signals.emplace(name, signal).second) << "twice: " << line;
    } else if (line.starts_with("VAL_ ")) {
      EXPECT_TRUE(read_values(line.c_str(), &id, &name, &signal.values)) << line;
      out.at(id).signals.at(name).values = signal.values;
    } else if (std::sscanf(line.c_str(), "BA_ \"%127[A-Za-z0-9]\" BO_ %u %d;", attribute.data(), &id,
                           &number) == 3) {
      set_attribute(attribute.data(), number, &out.at(id));
    } else if (read_start_value(line.c_str(), &id, &name, &number)) {
      out.at(id).signals.at(name).at_start = number;
    }
  }
  return out;
}

}  // namespace farpoint::test
