// SPDX-License-Identifier: Apache-2.0
// A JSON value to print or to query. Objects keep their order of insertion.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

namespace farpoint::tools {

class Json {
 public:
  using Object = std::vector<std::pair<std::string, Json>>;
  using Array = std::vector<Json>;

  Json() = default;                                    // null
  Json(double number) : value_(number) {}              // NOLINT: a number is a JSON value; NaN prints as null
  Json(bool truth) : value_(truth) {}                  // NOLINT
  Json(std::int64_t integer) : value_(integer) {}      // NOLINT
  Json(std::string text) : value_(std::move(text)) {}  // NOLINT
  Json(const char* text) : value_(std::string(text)) {}  // NOLINT
  Json(Array items) : value_(std::move(items)) {}        // NOLINT
  [[nodiscard]] static Json object() { return Json(Object{}); }

  // Appends to an object. Precondition: this is an object.
  void set(std::string key, Json value);

  // Returns the value at a dotted path through objects, null pointer without one.
  [[nodiscard]] const Json* find(std::string_view dotted_path) const;
  [[nodiscard]] bool is_number() const;  // and finite
  [[nodiscard]] double number() const;   // precondition: is_number()
  [[nodiscard]] bool is_object() const { return std::holds_alternative<Object>(value_); }

  // One line, no line end.
  [[nodiscard]] std::string dump() const;

 private:
  explicit Json(Object members) : value_(std::move(members)) {}

  std::variant<std::monostate, bool, double, std::int64_t, std::string, Array, Object> value_;
};

}  // namespace farpoint::tools
