// SPDX-License-Identifier: Apache-2.0
#include <map>
#include <set>
#include <sstream>

#include "tools/report/html.h"
#include "tools/report/sections.h"
#include "tools/report/svg.h"

namespace farpoint::tools::report {
namespace {

// The canonical text has one `key: value` a line; deeper keys are indented.
std::map<std::string, std::string> keys_of(const std::string& yaml) {
  std::map<std::string, std::string> keys;
  std::vector<std::pair<std::size_t, std::string>> parents;
  std::istringstream lines(yaml);
  for (std::string line; std::getline(lines, line);) {
    const std::size_t indent = line.find_first_not_of(' ');
    const std::size_t colon = line.find(':');
    if (indent == std::string::npos || colon == std::string::npos || line[indent] == '#') continue;
    while (!parents.empty() && parents.back().first >= indent) parents.pop_back();
    const std::string name =
        (parents.empty() ? "" : parents.back().second + ".") + line.substr(indent, colon - indent);
    const std::size_t value = line.find_first_not_of(' ', colon + 1);
    if (value == std::string::npos)
      parents.emplace_back(indent, name);
    else
      keys[name] = line.substr(value);
  }
  return keys;
}

std::string differences(const Runs& runs) {
  std::vector<std::map<std::string, std::string>> all;
  std::set<std::string> names;
  for (const RunRecord& run : runs) {
    all.push_back(run.summary() ? keys_of(run.summary()->configuration)
                                : std::map<std::string, std::string>{});
    for (const auto& [name, value] : all.back()) names.insert(name);
  }
  std::vector<std::vector<std::string>> rows = {{"key that differs"}};
  for (const RunRecord& run : runs) rows[0].push_back(run.name);
  for (const std::string& name : names) {
    std::set<std::string> values;
    std::vector<std::string> row = {name};
    for (auto& keys : all) {
      row.push_back(keys[name]);
      values.insert(keys[name]);
    }
    if (values.size() > 1) rows.push_back(row);
  }
  return rows.size() > 1 ? table(rows) : "";
}

}  // namespace

std::string configuration_section(const Runs& runs) {
  std::vector<std::vector<std::string>> rows = {{"run", "build", "configuration hash", "calibration hash"}};
  std::string texts;
  for (const RunRecord& run : runs) {
    const summary_t* s = run.summary();
    if (s == nullptr) continue;
    rows.push_back({run.name, s->build, s->configuration_hash, s->calibration_hash});
    texts += "<details><summary>Configuration of " + escaped(run.name) + "</summary><pre>" +
             escaped(s->configuration) + "</pre></details>\n";
  }
  if (rows.size() == 1) return {};
  return section("Configuration and build", "What made these runs.", table(rows) + differences(runs) + texts);
}

}  // namespace farpoint::tools::report
