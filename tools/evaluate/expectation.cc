// SPDX-License-Identifier: Apache-2.0
#include "tools/evaluate/expectation.h"

#include <charconv>
#include <cmath>
#include <cstdio>
#include <optional>
#include <sstream>
#include <string_view>

#include "tools/common/errors.h"

namespace farpoint::tools {
namespace {

using NamedRuns = std::vector<std::pair<std::string, Json>>;

[[noreturn]] void fail(const std::string& condition, const std::string& why) {
  throw InputError("--expect '" + condition + "': " + why);
}

// Words, comparisons and factors stand apart whether or not blanks do.
std::vector<std::string> words_of(const std::string& condition) {
  std::string spaced;
  for (std::size_t i = 0; i < condition.size(); ++i) {
    const bool comparison = std::string_view("<>=").find(condition[i]) != std::string_view::npos;
    const bool before = i > 0 && std::string_view("<>=").find(condition[i - 1]) != std::string_view::npos;
    if (comparison != before || condition[i] == '*') spaced += ' ';
    spaced += condition[i];
    if (condition[i] == '*') spaced += ' ';
  }
  std::istringstream stream(spaced);
  std::vector<std::string> words;
  for (std::string word; stream >> word;) {
    if (word != "*") words.push_back(word);
  }
  return words;
}

std::optional<double> to_number(std::string_view word) {
  double value = 0.0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error != std::errc() || end != word.data() + word.size() || !std::isfinite(value)) return std::nullopt;
  return value;
}

const Json* find_metric(const Json& run, std::string_view metric) {
  if (metric == "ate") metric = "final.ate_rmse_m";
  if (metric == "live_ate") metric = "live.ate_rmse_m";
  if (const Json* found = run.find(metric)) return found;
  return run.find("final." + std::string(metric));
}

// A metric inside a group that is null as a whole (`live` of a text file) is known, but has no value.
bool lies_in_null_group(const Json& run, std::string_view metric) {
  const std::size_t dot = metric.find('.');
  if (dot == std::string_view::npos) return metric == "live_ate";
  const Json* group = run.find(metric.substr(0, dot));
  return group != nullptr && !group->is_object() && !group->is_number();
}

// NaN where the run has no such value. Names may hold dots: the longest run name that fits is meant.
double metric_value(const std::string& condition, const std::string& word, const NamedRuns& runs) {
  const std::pair<std::string, Json>* named = nullptr;
  for (const auto& run : runs) {
    const bool fits = word.starts_with(run.first + ".");
    if (fits && (named == nullptr || run.first.size() > named->first.size())) named = &run;
  }
  if (named == nullptr) {
    std::string known;
    for (const auto& run : runs) known += (known.empty() ? "" : ", ") + run.first;
    fail(condition, "'" + word + "' names no run, expected NAME.METRIC with NAME one of: " + known);
  }
  const std::string metric = word.substr(named->first.size() + 1);
  const Json* value = find_metric(named->second, metric);
  if (value == nullptr && !lies_in_null_group(named->second, metric)) {
    fail(condition, "unknown metric '" + metric +
                        "', expected a key of --json such as ate, final.share or tracking_ms.p99");
  }
  if (value == nullptr || !value->is_number()) return std::nan("");
  return value->number();
}

bool compare(const std::string& condition, double left, const std::string& op, double right) {
  if (op == "<") return left < right;
  if (op == "<=") return left <= right;
  if (op == ">") return left > right;
  if (op == ">=") return left >= right;
  if (op == "==") return left == right;
  fail(condition, "unknown comparison '" + op + "', expected <, <=, >, >= or ==");
}

double right_hand_value(const std::string& condition, const std::vector<std::string>& words,
                        const NamedRuns& runs) {
  const std::optional<double> number = to_number(words[2]);
  if (words.size() == 3) return number ? *number : metric_value(condition, words[2], runs);
  if (!number) fail(condition, "expected a number as factor, found '" + words[2] + "'");
  return *number * metric_value(condition, words[3], runs);
}

}  // namespace

ExpectationResult check_expectation(const std::string& condition, const NamedRuns& runs) {
  const std::vector<std::string> words = words_of(condition);
  if (words.size() != 3 && words.size() != 4) {
    fail(condition, "expected 'NAME.METRIC OP [FACTOR] NAME.METRIC' or 'NAME.METRIC OP NUMBER'");
  }
  const double left = metric_value(condition, words[0], runs);
  const double right = right_hand_value(condition, words, runs);
  const bool holds = compare(condition, left, words[1], right);  // false where either is NaN
  char values[96];
  std::snprintf(values, sizeof values, " (%.6g %s %.6g)", left, words[1].c_str(), right);
  return {holds, condition + values};
}

}  // namespace farpoint::tools
