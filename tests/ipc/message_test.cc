// SPDX-License-Identifier: Apache-2.0
#include "ipc/message.h"

#include <gtest/gtest.h>

#include <cctype>
#include <fstream>
#include <map>
#include <random>
#include <sstream>
#include "tests/support/paths.h"

namespace farpoint::ipc {
namespace {

using Bytes = std::vector<std::uint8_t>;

// ---- Layouts, derived anew from the .lcm files ----

struct Member {
  std::string type, name;
  std::vector<std::string> dimensions;
};

std::string without_comments(std::istream& in) {
  std::string text, line;
  while (std::getline(in, line)) text += line.substr(0, line.find("//")) + "\n";
  return text;
}

std::vector<std::string> tokens(const std::string& text) {
  std::vector<std::string> out;
  for (std::size_t i = 0; i < text.size();) {
    const auto is_word = [&](std::size_t at) {
      return std::isalnum(text[at]) || text[at] == '_' || text[at] == '.';
    };
    if (std::isspace(text[i])) {
      ++i;
    } else if (is_word(i)) {
      std::size_t end = i;
      while (end < text.size() && is_word(end)) ++end;
      out.push_back(text.substr(i, end - i));
      i = end;
    } else {
      out.push_back(text.substr(i++, 1));
    }
  }
  return out;
}

std::vector<Member> members(const std::string& type) {
  std::ifstream file(test::source_dir() + "/ipc/types/" + type + ".lcm");
  EXPECT_TRUE(file) << type;
  const std::vector<std::string> words = tokens(without_comments(file));
  std::size_t at = 0;
  while (at < words.size() && words[at] != "{") ++at;
  std::vector<Member> out;
  for (++at; at < words.size() && words[at] != "}";) {
    if (words[at] == "const") {
      while (words[at] != ";") ++at;
      ++at;
      continue;
    }
    const std::string member_type = words[at++];
    while (words[at - 1] != ";") {
      Member member{member_type, words[at++], {}};
      while (words[at] == "[") {
        member.dimensions.push_back(words[at + 1]);
        at += 3;
      }
      out.push_back(member);
      ++at;  // ',' or ';'
    }
  }
  return out;
}

// Adds bytes to a canonical layout: neighbouring numbers become one.
struct Canonical {
  std::string text;
  std::size_t pending = 0;

  void bytes(std::size_t count) { pending += count; }
  void item(const std::string& what) {
    if (pending > 0) text += std::to_string(pending);
    pending = 0;
    text += what;
  }
  std::string finish() {
    item("");
    return text;
  }
};

std::string layout_of(const std::string& type);

void add_one(const std::string& type, std::size_t count, Canonical* out) {
  static const std::map<std::string, std::size_t> kBytes = {{"byte", 1},    {"boolean", 1}, {"int8_t", 1},
                                                            {"int16_t", 2}, {"int32_t", 4}, {"int64_t", 8},
                                                            {"float", 4},   {"double", 8}};
  if (const auto it = kBytes.find(type); it != kBytes.end()) {
    out->bytes(count * it->second);
  } else {
    for (std::size_t i = 0; i < count; ++i) out->item(type == "string" ? "s" : layout_of(type));
  }
}

std::string layout_of(const std::string& type) {
  const std::vector<Member> all = members(type);
  std::map<std::string, std::size_t> counts;
  Canonical out;
  for (const Member& member : all) {
    const bool is_count = std::any_of(all.begin(), all.end(), [&](const Member& m) {
      return !m.dimensions.empty() && m.dimensions[0] == member.name;
    });
    if (is_count) {
      counts.emplace(member.name, counts.size());
      out.item("#");
      continue;
    }
    std::size_t fixed = 1;
    std::string variable;
    for (const std::string& dimension : member.dimensions) {
      if (std::isdigit(dimension[0])) {
        fixed *= std::stoul(dimension);
      } else {
        EXPECT_TRUE(variable.empty()) << "one variable dimension at most: " << member.name;
        variable = dimension;
      }
    }
    if (variable.empty()) {
      add_one(member.type, fixed, &out);
    } else {
      Canonical element;
      add_one(member.type, fixed, &element);
      out.item("[" + std::to_string(counts.at(variable)) + ":" + element.finish() + "]");
    }
  }
  return out.finish();
}

// The same form of a hand-written layout.
std::string canonical(std::string_view layout) {
  Canonical out;
  for (std::size_t i = 0; i < layout.size(); ++i) {
    if (layout[i] == ' ') continue;
    if (std::isdigit(layout[i])) {
      std::size_t value = 0;
      for (; i < layout.size() && std::isdigit(layout[i]); ++i)
        value = 10 * value + static_cast<std::size_t>(layout[i] - '0');
      --i;
      out.bytes(value);
    } else if (layout[i] == '[') {
      out.item(std::string("[") + layout[i + 1] + ":");
      i += 2;
    } else {
      out.item(std::string(1, layout[i]));
    }
  }
  return out.finish();
}

// ---- Random messages, made from the derived layout ----

void put_big_endian(std::uint32_t value, Bytes* out) {
  for (int shift = 24; shift >= 0; shift -= 8) out->push_back(static_cast<std::uint8_t>(value >> shift));
}

void random_content(std::string_view layout, std::mt19937_64& rng, Bytes* out) {
  std::vector<std::uint32_t> counts;
  for (std::size_t i = 0; i < layout.size(); ++i) {
    if (std::isdigit(layout[i])) {
      std::size_t n = 0;
      for (; i < layout.size() && std::isdigit(layout[i]); ++i)
        n = 10 * n + static_cast<std::size_t>(layout[i] - '0');
      --i;
      for (std::size_t k = 0; k < n; ++k) out->push_back(static_cast<std::uint8_t>(rng()));
    } else if (layout[i] == 's') {
      const auto length = static_cast<std::uint32_t>(rng() % 20);
      put_big_endian(length + 1, out);
      for (std::uint32_t k = 0; k < length; ++k) out->push_back(static_cast<std::uint8_t>('a' + rng() % 26));
      out->push_back(0);
    } else if (layout[i] == '#') {
      counts.push_back(static_cast<std::uint32_t>(rng() % 6));
      put_big_endian(counts.back(), out);
    } else if (layout[i] == '[') {
      int depth = 1;
      std::size_t end = i + 1;
      while (true) {
        depth += layout[end] == '[' ? 1 : layout[end] == ']' ? -1 : 0;
        if (depth == 0) break;
        ++end;
      }
      const std::string_view content = layout.substr(i + 3, end - i - 3);
      const std::uint32_t count = counts.at(static_cast<std::size_t>(layout[i + 1] - '0'));
      for (std::uint32_t k = 0; k < count; ++k) random_content(content, rng, out);
      i = end;
    }
  }
}

template <typename Message>
class EveryMessage : public testing::Test {};

using AllMessages =
    testing::Types<calibration_t, ground_truth_t, image_t, imu_t, landmarks_t, map_from_odom_t, map_t,
                   odometry_t, pose_t, simulation_t, status_t, summary_t, timing_t, trajectory_t, wheels_t>;
TYPED_TEST_SUITE(EveryMessage, AllMessages);

template <typename Message>
Bytes random_message(std::mt19937_64& rng) {
  Bytes bytes;
  const auto hash = static_cast<std::uint64_t>(Message::getHash());
  put_big_endian(static_cast<std::uint32_t>(hash >> 32), &bytes);
  put_big_endian(static_cast<std::uint32_t>(hash), &bytes);
  random_content(layout_of(Message::getTypeName()), rng, &bytes);
  return bytes;
}

TYPED_TEST(EveryMessage, LayoutEqualsTheLcmFile) {
  EXPECT_EQ(canonical(kLayout<TypeParam>), layout_of(TypeParam::getTypeName()));
}

TYPED_TEST(EveryMessage, BeginsWithUtime) {
  EXPECT_EQ(members(TypeParam::getTypeName()).at(0).type, "int64_t");
  EXPECT_EQ(members(TypeParam::getTypeName()).at(0).name, "utime");
}

TYPED_TEST(EveryMessage, ComesBackByteForByte) {
  std::mt19937_64 rng(1);
  for (int i = 0; i < 20; ++i) {
    const Bytes bytes = random_message<TypeParam>(rng);
    TypeParam message{};
    ASSERT_TRUE(decode(bytes, &message));
    Bytes again;
    encode(message, &again);
    EXPECT_EQ(again, bytes);
  }
}

TYPED_TEST(EveryMessage, CutOffOrTooLongIsRefused) {
  std::mt19937_64 rng(2);
  Bytes bytes = random_message<TypeParam>(rng);
  TypeParam message{};
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    EXPECT_FALSE(decode(std::span(bytes).first(size), &message)) << size << " of " << bytes.size();
  }
  bytes.push_back(0);
  EXPECT_FALSE(decode(bytes, &message));
}

// Any flipped bit is survived; one in the fingerprint or in a length is refused.
TYPED_TEST(EveryMessage, FlippedBitsAreSurvived) {
  std::mt19937_64 rng(3);
  const Bytes bytes = random_message<TypeParam>(rng);
  int refused = 0;
  for (std::size_t bit = 0; bit < 8 * bytes.size(); ++bit) {
    Bytes damaged = bytes;
    damaged[bit / 8] = static_cast<std::uint8_t>(damaged[bit / 8] ^ (1U << (bit % 8)));
    TypeParam message{};
    const bool decoded = decode(damaged, &message);
    refused += decoded ? 0 : 1;
    if (bit < 64) {
      EXPECT_FALSE(decoded) << "fingerprint bit " << bit;
    }
  }
  EXPECT_GE(refused, 64);
}

TYPED_TEST(EveryMessage, NoiseIsRefused) {
  std::mt19937_64 rng(4);
  for (int i = 0; i < 2000; ++i) {
    Bytes noise;
    const auto hash = static_cast<std::uint64_t>(TypeParam::getHash());
    put_big_endian(static_cast<std::uint32_t>(hash >> 32), &noise);
    put_big_endian(static_cast<std::uint32_t>(hash), &noise);
    const std::size_t length = rng() % 300;
    for (std::size_t k = 0; k < length; ++k) noise.push_back(static_cast<std::uint8_t>(rng()));
    TypeParam message{};
    Bytes again;
    if (decode(noise, &message)) {  // what is taken must be consistent
      encode(message, &again);
      EXPECT_EQ(again.size(), noise.size());
    }
  }
}

// The lengths that break lcm-gen's own decoder.
TEST(Message, AStringEndsAtItsOnlyNul) {
  simulation_t message{};
  message.world_name = "town";
  Bytes data;
  encode(message, &data);
  constexpr std::size_t kFirstCharacter = 8 + 8 + 4 + 4;  // fingerprint, utime, version, length
  simulation_t decoded;
  ASSERT_TRUE(decode(data, &decoded));
  for (std::size_t i = 0; i < 4; ++i) {
    Bytes damaged = data;
    damaged[kFirstCharacter + i] = 0;
    EXPECT_FALSE(decode(damaged, &decoded)) << i;
  }
  data[kFirstCharacter + 4] = 'x';
  EXPECT_FALSE(decode(data, &decoded)) << "no NUL";
}

TEST(Message, HostileLengths) {
  image_t image{};
  image.size = 4;
  image.data.assign(4, 7);
  Bytes bytes;
  encode(image, &bytes);
  const std::size_t size_at = bytes.size() - 8;
  for (const std::uint32_t size : {0xffffffffU, 0x80000000U, 0x7fffffffU, 0x20000001U, 5U, 3U}) {
    Bytes hostile = bytes;
    for (std::size_t i = 0; i < 4; ++i)
      hostile[size_at + i] = static_cast<std::uint8_t>(size >> (24 - 8 * i));
    EXPECT_FALSE(decode(hostile, &image)) << size;
  }
  calibration_t calibration{};
  calibration.body_name = "b";
  encode(calibration, &bytes);
  for (const std::uint32_t length : {0U, 0x80000000U, 0xffffffffU, 0x7fffffffU}) {
    Bytes hostile = bytes;
    for (std::size_t i = 0; i < 4; ++i) hostile[16 + i] = static_cast<std::uint8_t>(length >> (24 - 8 * i));
    EXPECT_FALSE(decode(hostile, &calibration)) << length;
  }
}

}  // namespace
}  // namespace farpoint::ipc
