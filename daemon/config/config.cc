// SPDX-License-Identifier: Apache-2.0
#include "daemon/config/config.h"

#include <spdlog/fmt/fmt.h>
#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <optional>
#include <set>
#include <sstream>
#include <system_error>

#include "daemon/config/yaml_file.h"
#include "drivers/mavlink/mavlink_link.h"
#include "ipc/can_frame.h"
#include "ipc/printable.h"

namespace farpoint::daemon {
namespace {

// Number of single-character edits (insert, delete, replace, swap of neighbours) between two words.
std::size_t edit_distance(const std::string& a, const std::string& b) {
  std::vector<std::vector<std::size_t>> d(a.size() + 1, std::vector<std::size_t>(b.size() + 1));
  for (std::size_t i = 0; i <= a.size(); ++i) d[i][0] = i;
  for (std::size_t j = 0; j <= b.size(); ++j) d[0][j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t replace = d[i - 1][j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1);
      d[i][j] = std::min({d[i - 1][j] + 1, d[i][j - 1] + 1, replace});
      const bool swapped = i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1];
      if (swapped) d[i][j] = std::min(d[i][j], d[i - 2][j - 2] + 1);
    }
  }
  return d[a.size()][b.size()];
}

// Names of the keys and of the sections above them.
const std::set<std::string>& section_names() {
  static const std::set<std::string> sections = [] {
    std::set<std::string> names;
    for (const ConfigKey& key : config_keys()) {
      for (std::size_t dot = key.name.find('.'); dot != std::string::npos;
           dot = key.name.find('.', dot + 1)) {
        names.insert(key.name.substr(0, dot));
      }
    }
    return names;
  }();
  return sections;
}

const ConfigKey* find_key(const std::string& name) {
  const auto keys = config_keys();
  const auto found =
      std::find_if(keys.begin(), keys.end(), [&](const ConfigKey& k) { return k.name == name; });
  return found == keys.end() ? nullptr : &*found;
}

// The known name nearest to a wrong one, as a question; or where to find the list.
std::string suggestion(const std::string& name) {
  constexpr std::size_t kLongestName = 100;
  constexpr const char* kNone = "expected a key of config/farpoint.yaml";
  if (name.size() > kLongestName) return kNone;
  std::string nearest;
  std::size_t best = std::max<std::size_t>(2, name.size() / 3) + 1;
  const auto consider = [&](const std::string& candidate) {
    const std::size_t distance = edit_distance(name, candidate);
    if (distance < best) {
      best = distance;
      nearest = candidate;
    }
  };
  for (const ConfigKey& key : config_keys()) {
    consider(key.name);
    // The right key in the wrong section: compare the last word alone.
    const std::string word = name.substr(name.rfind('.') + 1);
    if (best > 0 && key.name.substr(key.name.rfind('.') + 1) == word) {
      best = 0;
      nearest = key.name;
    }
  }
  for (const std::string& section : section_names()) consider(section);
  if (nearest.empty()) return kNone;
  return "did you mean '" + nearest + "'?";
}

// What a user wrote, shortened.
std::string quote(const std::string& text) {
  return fmt::format("'{}{}'", text.substr(0, 60), text.size() > 60 ? "..." : "");
}

// Text as a YAML scalar in double quotes.
std::string quoted_yaml(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) out += (c == '"' || c == '\\') ? std::string{'\\', c} : std::string{c};
  return out + '"';
}

template <typename T>
std::optional<T> parse_all(std::string text) {
  if (text.starts_with('+')) text.erase(0, 1);
  T value{};
  const auto result = std::from_chars(text.data(), text.data() + text.size(), value);
  if (result.ec != std::errc() || result.ptr != text.data() + text.size() || text.empty())
    return std::nullopt;
  return value;
}

bool acceptable(const ConfigKey& key, const std::string& text, bool quoted) {
  switch (key.type) {
    case KeyType::kInteger: {
      const auto value = parse_all<long long>(text);
      return !quoted && value && static_cast<double>(*value) >= key.min &&
             static_cast<double>(*value) <= key.max;
    }
    case KeyType::kNumber: {
      const auto value = parse_all<double>(text);
      return !quoted && value && std::isfinite(*value) && *value >= key.min && *value <= key.max;
    }
    case KeyType::kText:
      return !text.empty() && std::none_of(text.begin(), text.end(),
                                           [](char c) { return static_cast<unsigned char>(c) < 0x20; });
    case KeyType::kChoice:
      return std::find(key.choices.begin(), key.choices.end(), text) != key.choices.end();
  }
  return false;
}

// One line, whatever the file held.
[[noreturn]] void fail(const std::string& place, const std::string& message) {
  throw ConfigError(ipc::printable(place + ": " + message));
}

void assign(const ConfigKey& key, const std::string& text, bool quoted, const std::string& place,
            Config* config, ConfigOrigins* origins) {
  if (!acceptable(key, text, quoted)) {
    const bool number_in_quotes = quoted && (key.type == KeyType::kInteger || key.type == KeyType::kNumber);
    fail(place, key.name + ": " + (number_in_quotes ? "text " : "") + quote(text) + ", expected " +
                    expectation(key) + (number_in_quotes ? " without quotes" : ""));
  }
  key.set(*config, text.starts_with('+') && key.type != KeyType::kText ? text.substr(1) : text);
  (*origins)[key.name] = place;
}

// Walks one YAML map. The depth is bounded by the table: an unknown section ends the walk.
class FileReader {
 public:
  FileReader(std::string file, Config* config, ConfigOrigins* origins, std::vector<std::string>* warnings,
             std::span<const DroppedKey> dropped)
      : file_(std::move(file)), config_(config), origins_(origins), warnings_(warnings), dropped_(dropped) {}

  void read_section(const YAML::Node& node, const std::string& section) {
    std::map<std::string, int> seen;
    for (const auto& entry : node) {
      if (!entry.first.IsScalar())
        fail(place(entry.first), "a key is not a word, expected 'section: key: value'");
      const std::string word = entry.first.Scalar();
      const std::string name = section.empty() ? word : section + "." + word;
      const auto [before, first] = seen.emplace(word, line(entry.first));
      if (!first) {
        fail(place(entry.first), name + ": duplicate key, expected it once (first in line " +
                                     std::to_string(before->second) + ")");
      }
      read_entry(name, entry.first, entry.second);
    }
  }

  [[nodiscard]] std::string place(const YAML::Node& node) const {
    return file_ + ":" + std::to_string(line(node));
  }

 private:
  static int line(const YAML::Node& node) { return node.Mark().line + 1; }

  void read_entry(const std::string& name, const YAML::Node& name_node, const YAML::Node& value) {
    if (section_names().contains(name)) {
      if (value.IsNull()) return;  // every key of the section commented out
      if (!value.IsMap()) fail(place(name_node), name + ": expected a section with keys below it");
      read_section(value, name);
      return;
    }
    const ConfigKey* key = find_key(name);
    if (key == nullptr && passed_over(name, place(name_node))) return;
    if (key == nullptr) fail(place(name_node), name + ": unknown key, " + suggestion(name));
    if (!value.IsScalar()) {
      const char* found = value.IsNull() ? "nothing" : value.IsMap() ? "a section" : "a list";
      fail(place(name_node), name + ": " + found + ", expected " + expectation(*key));
    }
    assign(*key, value.Scalar(), value.Tag() == "!", place(name_node), config_, origins_);
  }

  // True for a dropped key, or a section of such keys.
  bool passed_over(const std::string& name, const std::string& where) {
    const auto key = std::find_if(dropped_.begin(), dropped_.end(), [&](const DroppedKey& k) {
      return k.name == name || k.name.starts_with(name + ".");
    });
    if (key == dropped_.end()) return false;
    const bool whole_section = key->name != name;
    const std::string advice = whole_section || key->heir.empty() ? "" : "; set " + key->heir + " instead";
    if (warnings_ != nullptr)
      warnings_->push_back(where + ": " + name + ": no key of this version, passed over" + advice);
    return true;
  }

  std::string file_;
  Config* config_;
  ConfigOrigins* origins_;
  std::vector<std::string>* warnings_;
  std::span<const DroppedKey> dropped_;
};

std::string read_file(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  if (!in)
    fail(path, "cannot be opened (" + std::generic_category().message(errno) + "), expected a YAML file");
  std::string text(kMaxYamlBytes + 1, '\0');
  in.read(text.data(), static_cast<std::streamsize>(text.size()));
  if (in.bad()) fail(path, "cannot be read, expected a YAML file");
  text.resize(static_cast<std::size_t>(in.gcount()));
  if (text.size() > kMaxYamlBytes)
    fail(path, "longer than 1 MiB, expected a YAML file like config/farpoint.yaml");
  return text;
}

// Notes where documents begin. YAML::LoadAll() does not end for some texts, such as one that begins with a
// comma.
class Documents final : public YAML::EventHandler {
 public:
  // Places of the first two.
  std::vector<YAML::Mark> starts;

  void OnDocumentStart(const YAML::Mark& mark) override { starts.push_back(mark); }
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark&, YAML::anchor_t) override {}
  void OnAlias(const YAML::Mark&, YAML::anchor_t) override {}
  void OnScalar(const YAML::Mark&, const std::string&, YAML::anchor_t, const std::string&) override {}
  void OnSequenceStart(const YAML::Mark&, const std::string&, YAML::anchor_t,
                       YAML::EmitterStyle::value) override {}
  void OnSequenceEnd() override {}
  void OnMapStart(const YAML::Mark&, const std::string&, YAML::anchor_t, YAML::EmitterStyle::value) override {
  }
  void OnMapEnd() override {}
};

// The file's document; undefined for an empty file.
YAML::Node load_document(const std::string& text, const std::string& file_name) {
  std::istringstream stream(text);
  YAML::Parser parser(stream);
  Documents documents;
  if (parser.HandleNextDocument(documents)) parser.HandleNextDocument(documents);
  if (documents.starts.size() > 1)
    fail(file_name + ":" + std::to_string(documents.starts[1].line + 1), "a second document, expected one");
  return YAML::Load(text);
}

std::string place_of(const std::string& key, const ConfigOrigins& origins) {
  const auto set_at = origins.find(key);
  return set_at == origins.end() ? "built-in defaults" : set_at->second;
}

void check_second_camera(const CameraConfig& camera, const ConfigOrigins& origins) {
  if (!camera.has_second()) return;
  const std::string device = "camera.second_device: " + quote(camera.second_device);
  if (camera.second_device == camera.device)
    fail(place_of("camera.second_device", origins), device + ", expected another camera than camera.device");
  // libcamera allows one manager of cameras in a process, and ours has one for each camera.
  if (camera.driver == CameraDriverChoice::kLibcamera)
    fail(place_of("camera.second_device", origins),
         device + ", expected 'none' with camera.driver libcamera");
  // Two readers of one log would begin at different times.
  if (camera.driver == CameraDriverChoice::kFile)
    fail(place_of("camera.second_device", origins), device + ", expected 'none' with camera.driver file");
  constexpr double kMicrosPerSecond = 1e6;
  if (camera.rate_hz > 0.0 && 2.0 * camera.pair_tolerance_us >= kMicrosPerSecond / camera.rate_hz) {
    fail(place_of("camera.pair_tolerance_us", origins),
         fmt::format(
             "camera.pair_tolerance_us: {}, expected less than half a frame period of camera.rate_hz ({})",
             camera.pair_tolerance_us, camera.rate_hz));
  }
}

void check_can(const CanConfig& can, const ConfigOrigins& origins) {
  try {
    (void)can_layout(can);
  } catch (const ConfigError& error) {
    const std::string what = error.what();
    fail(place_of(what.substr(0, what.find(':')), origins), what);
  }
}

void check_mavlink(const MavlinkConfig& mavlink, const ConfigOrigins& origins) {
  const std::string problem = drivers::MavlinkAddress::check(mavlink.link);
  if (!problem.empty())
    fail(place_of("mavlink.link", origins), "mavlink.link: " + quote(mavlink.link) + ", " + problem);
}

}  // namespace

void load_config_file(const std::string& path, Config* config, ConfigOrigins* origins,
                      std::vector<std::string>* warnings) {
  load_config_text(read_file(path), path, config, origins, warnings);
}

void load_config_text(const std::string& text, const std::string& file_name, Config* config,
                      ConfigOrigins* origins, std::vector<std::string>* warnings,
                      std::span<const DroppedKey> dropped) {
  YAML::Node document;
  try {
    document = load_document(text, file_name);
  } catch (const YAML::Exception& error) {
    fail(file_name + ":" + std::to_string(error.mark.line + 1),
         "not YAML: " + error.msg + ", expected 'section:' and 'key: value' lines");
  }
  if (!document.IsDefined() || document.IsNull()) return;
  FileReader reader(file_name, config, origins, warnings, dropped);
  if (!document.IsMap())
    fail(reader.place(document), "not a map, expected 'section:' and 'key: value' lines");
  reader.read_section(document, "");
}

void apply_setting(const std::string& assignment, Config* config, ConfigOrigins* origins) {
  const std::size_t equals = assignment.find('=');
  if (equals == std::string::npos || equals == 0) {
    fail("--set", quote(assignment) + ", expected dotted.key=value, like tracking.min_inliers=30");
  }
  const std::string name = assignment.substr(0, equals);
  const ConfigKey* key = find_key(name);
  if (key == nullptr && section_names().contains(name)) {
    fail("--set", name + ": a section, expected one of its keys, like " + name + ".key=value");
  }
  if (key == nullptr) fail("--set", name + ": unknown key, " + suggestion(name));
  assign(*key, assignment.substr(equals + 1), false, "--set", config, origins);
}

ipc::CanLayout can_layout(const CanConfig& config) {
  ipc::CanLayout layout;
  layout.base_id = static_cast<std::uint32_t>(config.base_id);
  layout.extended = config.extended_ids;
  layout.base_data_id = static_cast<std::uint16_t>(config.base_data_id);
  layout.fd = config.fd;
  layout.rate_hz = config.rate_hz;
  const std::string problem = ipc::parse_can_messages(config.messages, &layout.every);
  if (!problem.empty()) throw ConfigError("can.messages: " + problem);
  const std::uint32_t most = layout.extended ? ipc::kMaxExtendedCanId : ipc::kMaxStandardCanId;
  const std::uint32_t last = layout.base_id + ipc::kCanMessages - 1;
  if (last > most) {
    throw ConfigError(fmt::format("can.base_id: {}, expected at most {} with identifiers of {} bits",
                                  config.base_id, most + 1 - ipc::kCanMessages, layout.extended ? 29 : 11));
  }
  return layout;
}

void check_relations(const Config& config, const ConfigOrigins& origins) {
  // The place of the pair is where either of the two was last set.
  const auto require_not_above = [&](const std::string& low, const std::string& high) {
    const auto number = [&](const std::string& name) { return *parse_all<double>(value_text(config, name)); };
    if (number(low) <= number(high)) return;
    const auto set_at = origins.contains(low) ? origins.find(low) : origins.find(high);
    const std::string place = set_at == origins.end() ? "built-in defaults" : set_at->second;
    fail(place, low + ": " + value_text(config, low) + ", expected at most " + high + " (" +
                    value_text(config, high) + ")");
  };
  require_not_above("extractor.fast_threshold_min", "extractor.fast_threshold");
  require_not_above("tracking.min_inliers", "tracking.degraded_inliers");
  require_not_above("keyframes.min_interval_s", "keyframes.max_interval_s");
  if (config.camera.rate_hz > 0.0 && config.camera.lost_after_s < 1.5 / config.camera.rate_hz) {
    fail(place_of("camera.lost_after_s", origins),
         "camera.lost_after_s: " + value_text(config, "camera.lost_after_s") +
             ", expected at least one and a half frame periods of camera.rate_hz (" +
             value_text(config, "camera.rate_hz") + ")");
  }
  require_not_above("camera.exposure_short_us", "camera.exposure_max_us");
  check_second_camera(config.camera, origins);
  check_can(config.can, origins);
  check_mavlink(config.mavlink, origins);
  require_not_above("mapping.quick_view_delay_ms", "mapping.full_view_delay_ms");
  require_not_above("mapping.window_keyframes", "capacity.keyframes");
  require_not_above("landmarks.max_bearing", "capacity.landmarks");
}

std::string value_text(const Config& config, const std::string& name) {
  const ConfigKey* key = find_key(name);
  if (key == nullptr) throw std::out_of_range("no configuration key " + name);
  return key->get(config);
}

std::string canonical_text(const Config& config) {
  std::ostringstream out;
  std::string open_section;
  for (const ConfigKey& key : config_keys()) {
    const std::size_t dot = key.name.find('.');
    const std::string section = key.name.substr(0, dot);
    if (section != open_section) out << section << ":\n";
    open_section = section;
    const bool text = key.type == KeyType::kText;
    out << "  " << key.name.substr(dot + 1) << ": " << (text ? quoted_yaml(key.get(config)) : key.get(config))
        << '\n';
  }
  return out.str();
}

std::uint64_t fnv1a_64(const std::string& text) {
  std::uint64_t hash = 0xcbf29ce484222325ULL;
  for (const char c : text) {
    hash ^= static_cast<unsigned char>(c);
    hash *= 0x100000001b3ULL;
  }
  return hash;
}

std::uint64_t config_hash(const Config& config) {
  return fnv1a_64(canonical_text(config));
}

}  // namespace farpoint::daemon
