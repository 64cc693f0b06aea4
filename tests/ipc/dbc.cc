#include "tests/ipc/dbc.h"

#include <gtest/gtest.h>

#include <fstream>
#include <limits>
#include <regex>

namespace farpoint::test {

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
  const std::regex message_line(R"(^BO_ (\d+) (\w+): (\d+) \w+\s*$)");
  const std::regex signal_line(
      R"re(^ SG_ (\w+) : (\d+)\|(\d+)@1([+-]) \(([-.\d]+),([-.\d]+)\) \[([-.\d]+)\|([-.\d]+)\] "([^"]*)" \w+\s*$)re");
  const std::regex values_line(R"(^VAL_ (\d+) (\w+) (.*);\s*$)");
  const std::regex one_value(R"re((-?\d+) "([^"]*)")re");
  const std::regex data_id_line(R"re(^BA_ "E2EDataId" BO_ (\d+) (\d+);\s*$)re");

  std::map<std::uint32_t, DbcMessage> out;
  std::ifstream file(path);
  EXPECT_TRUE(file) << path;
  std::uint32_t id = 0;
  std::string line;
  std::smatch m;
  const auto number = [&m](std::size_t group) { return static_cast<std::uint32_t>(std::stoul(m[group])); };
  while (std::getline(file, line)) {
    if (std::regex_match(line, m, message_line)) {
      id = number(1);
      EXPECT_TRUE(out.emplace(id, DbcMessage{m[2], number(3), -1, {}}).second) << "twice: " << line;
    } else if (std::regex_match(line, m, signal_line)) {
      DbcSignal signal{number(2),       number(3),         m[4] == "-",
                       std::stod(m[5]), std::stod(m[6]),   std::stod(m[7]),
                       std::stod(m[8]), std::string(m[9]), {}};
      EXPECT_TRUE(out[id].signals.emplace(m[1], signal).second) << "twice: " << line;
    } else if (std::regex_match(line, m, values_line)) {
      DbcSignal& signal = out.at(number(1)).signals.at(m[2]);
      const std::string list = m[3];
      for (std::sregex_iterator it(list.begin(), list.end(), one_value), end; it != end; ++it) {
        signal.values[std::stoll((*it)[1])] = (*it)[2];
      }
    } else if (std::regex_match(line, m, data_id_line)) {
      out.at(number(1)).data_id = std::stoi(m[2]);
    } else {
      EXPECT_FALSE(line.starts_with("BO_ ") || line.starts_with(" SG_") || line.starts_with("VAL_ ")) << line;
    }
  }
  return out;
}

}  // namespace farpoint::test
