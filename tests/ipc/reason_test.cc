// SPDX-License-Identifier: Apache-2.0
#include "ipc/reason.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <set>
#include <string>

namespace farpoint::ipc {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

std::string text(Reason reason, double value, double wanted) {
  std::array<char, kReasonText> buffer;
  return std::string(reason_text(reason, value, wanted, buffer));
}

TEST(Reason, TheSentenceHoldsWhatWasMeasuredAndWhatIsNeeded) {
  EXPECT_EQ(text(Reason::kLittleParallax, 0.004, 0.0175),
            "waiting for sideways motion: 0.0040 of 0.0175 rad");
  EXPECT_EQ(text(Reason::kTooDark, 31, 80), "too dark, blurred or empty: 31 features, 80 needed");
  EXPECT_EQ(text(Reason::kMapSettling, 0.034, 0.02),
            "the young map's unit changes: 3.4 % by the last adjustment, 2.0 % allowed");
}

TEST(Reason, WithoutNumbersTheSentenceHasNone) {
  EXPECT_EQ(text(Reason::kLittleParallax, kNone, kNone), "waiting for sideways motion");
  EXPECT_EQ(text(Reason::kNone, 1, 2), "");
}

TEST(Reason, EachCodeHasASentenceOfItsOwnThatFits) {
  std::set<std::string> sentences;
  for (const int code :
       {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 16, 17, 18, 19, 20, 21, 22, 23, 24, 25, 26, 27, 28, 29})
    for (const double value : {kNone, 1e-9, 1234567.0}) {
      const std::string sentence = text(static_cast<Reason>(code), value, value);
      EXPECT_FALSE(sentence.empty()) << code;
      EXPECT_LT(sentence.size(), kReasonText) << code;
      if (std::isnan(value)) {
        EXPECT_TRUE(sentences.insert(sentence).second) << sentence;
      }
    }
}

TEST(Reason, AnyCodeAndAnyNumberStayWithinTheBuffer) {
  for (int code = 0; code < 256; ++code)
    EXPECT_LE(text(static_cast<Reason>(code), std::numeric_limits<double>::max(), -1e300).size(),
              kReasonText);
}

}  // namespace
}  // namespace farpoint::ipc
