// SPDX-License-Identifier: Apache-2.0
#include "tools/common/json.h"

#include <cmath>
#include <cstdio>

namespace farpoint::tools {
namespace {

std::string quoted(const std::string& text) {
  std::string result = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') {
      result += '\\';
      result += c;
    } else if (static_cast<unsigned char>(c) < 0x20) {
      char escape[8];
      std::snprintf(escape, sizeof escape, "\\u%04x", static_cast<unsigned>(c));
      result += escape;
    } else {
      result += c;
    }
  }
  return result + "\"";
}

std::string number_text(double value) {
  if (!std::isfinite(value)) return "null";  // JSON knows neither NaN nor infinity
  char text[32];
  std::snprintf(text, sizeof text, "%.10g", value);
  return text;
}

}  // namespace

void Json::set(std::string key, Json value) {
  std::get<Object>(value_).emplace_back(std::move(key), std::move(value));
}

const Json* Json::find(std::string_view dotted_path) const {
  if (dotted_path.empty()) return this;
  const Object* members = std::get_if<Object>(&value_);
  if (members == nullptr) return nullptr;
  const std::string_view key = dotted_path.substr(0, dotted_path.find('.'));
  const std::string_view rest = key.size() == dotted_path.size() ? "" : dotted_path.substr(key.size() + 1);
  for (const auto& [name, value] : *members) {
    if (name == key) return value.find(rest);
  }
  return nullptr;
}

bool Json::is_number() const {
  if (const double* d = std::get_if<double>(&value_)) return std::isfinite(*d);
  return std::holds_alternative<std::int64_t>(value_);
}

double Json::number() const {
  if (const std::int64_t* i = std::get_if<std::int64_t>(&value_)) return static_cast<double>(*i);
  return std::get<double>(value_);
}

std::string Json::dump() const {
  struct Printer {
    std::string operator()(std::monostate) const { return "null"; }
    std::string operator()(bool v) const { return v ? "true" : "false"; }
    std::string operator()(double v) const { return number_text(v); }
    std::string operator()(std::int64_t v) const { return std::to_string(v); }
    std::string operator()(const std::string& v) const { return quoted(v); }
    std::string operator()(const Array& items) const {
      std::string text = "[";
      for (const Json& item : items) text.append(text.size() > 1 ? "," : "").append(item.dump());
      return text.append("]");
    }
    std::string operator()(const Object& members) const {
      std::string text = "{";
      for (const auto& [key, value] : members) {
        text.append(text.size() > 1 ? "," : "").append(quoted(key)).append(":").append(value.dump());
      }
      return text.append("}");
    }
  };
  return std::visit(Printer{}, value_);
}

}  // namespace farpoint::tools
