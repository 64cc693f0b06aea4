// SPDX-License-Identifier: Apache-2.0
#include "ipc/printable.h"

#include <gtest/gtest.h>

#include <random>

namespace farpoint::ipc {
namespace {

using namespace std::string_literals;

TEST(Printable, OrdinaryTextStaysAsItIs) {
  for (const std::string& text : {""s, "camera /dev/video0: lost"s, "C:\\x [1;31m"s, "Grüße, 地図, 🚗"s}) {
    EXPECT_EQ(printable(text), text);
    EXPECT_TRUE(is_printable_line(text)) << text;
  }
}

TEST(Printable, ControlCharactersAreEscaped) {
  const std::pair<std::string, std::string> cases[] = {
      {"a\nb", "a\\nb"},
      {"\n<0>all is lost", "\\n<0>all is lost"},
      {"a\r\tb", "a\\r\\tb"},
      {"\x1b[2J", "\\x1b[2J"},
      {"a\0b"s, "a\\x00b"},
      {"\x7f", "\\x7f"},
      {"\xc2\x85", "\\xc2\\x85"},                    // C1: next line
      {"\xe2\x80\xa8", "\\xe2\\x80\\xa8"},           // line separator
      {"\xff\xfe", "\\xff\\xfe"},                    // no UTF-8
      {"\xc0\x8a", "\\xc0\\x8a"},                    // an overlong line break
      {"\xe0\x80\x8a", "\\xe0\\x80\\x8a"},           // another
      {"\xed\xa0\x80", "\\xed\\xa0\\x80"},           // half a surrogate pair
      {"\xf4\x90\x80\x80", "\\xf4\\x90\\x80\\x80"},  // beyond Unicode
      {"\xe5\x9c", "\\xe5\\x9c"},                    // cut off
  };
  for (const auto& [text, wanted] : cases) {
    EXPECT_EQ(printable(text), wanted);
    EXPECT_FALSE(is_printable_line(text)) << wanted;
  }
}

TEST(Printable, LongTextIsCut) {
  EXPECT_EQ(printable("abcdefgh", 8), "abcdefgh");
  EXPECT_EQ(printable("abcdefghi", 8), "abcde...");
  EXPECT_EQ(printable("abcd\n\n\n", 8), "abcd...") << "no escape is cut in two";
  EXPECT_EQ(printable(std::string(100'000, 'x')).size(), kMaxLineBytes);
  EXPECT_FALSE(is_printable_line(std::string(100'000, 'x')));
}

TEST(Printable, WhatItReturnsIsPrintable) {
  std::mt19937 random(3);
  for (int i = 0; i < 20'000; ++i) {
    std::string text(random() % 12, ' ');
    for (char& c : text) c = static_cast<char>(random());
    const std::string line = printable(text);
    EXPECT_TRUE(is_printable_line(line)) << line;
    EXPECT_EQ(line == text, is_printable_line(text)) << line;
  }
}

}  // namespace
}  // namespace farpoint::ipc
