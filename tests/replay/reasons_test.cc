// SPDX-License-Identifier: Apache-2.0
// Runs that cannot start or stay sound, each with its reason: in the last line, and in `farpoint top` within
// 2 s of the cause. Altered parts of recordings through the daemon, in lockstep.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "tests/ipc/log_events.h"
#include "tests/ipc/scratch.h"
#include "tests/replay/recordings.h"
#include "tests/support/altered_log.h"
#include "tests/support/bonnet.h"
#include "tests/support/record.h"
#include "tools/top/board.h"

namespace farpoint::test {
namespace {

namespace fs = std::filesystem;

constexpr std::int64_t kPeriod_us = 103'600;  // of KITTI 03
const std::string kKitti = "kitti {}/kitti 03", kEuroc = "euroc {}/euroc/MH_01_part";

double seconds(std::int64_t us) {
  return 1e-6 * static_cast<double>(us);
}

class RecordedReasons : public testing::Test {
 protected:
  // The recording as a log, imported once a test program.
  static std::string recording(const std::string& arguments) {
    static const Scratch folder;
    std::string log = folder.path(std::to_string(std::hash<std::string>()(arguments)) + ".lcm");
    if (!fs::exists(log)) {
      EXPECT_TRUE(import_recording(arguments, log));
    }
    return log;
  }

  void SetUp() override {
    if (!fs::exists(kData / "kitti")) GTEST_SKIP() << "no recordings in " << kData;
  }

  // Replays the altered log.
  void replay() {
    const std::string said = work_.path("said.txt"), out = work_.path("out.lcm");
    ASSERT_EQ(run((kBin / "farpointd").string() + " --replay " + log_ + " --lockstep --output " + out +
                  " --set log.level=warning > " + said),
              0);
    const std::vector<std::uint8_t> bytes = read_bytes(said);
    last_line_.assign(bytes.begin(), bytes.end());
    last_line_ = last_line_.substr(last_line_.rfind("farpointd: "));
    status_ = messages_of<status_t>(out, ipc::kStatusChannel);
    print_story();
  }

  // Each change of the sentence, beside the last line.
  void print_story() const {
    fmt::print("{}", last_line_);
    std::string before;
    for (const status_t& s : status_) {
      const std::string words = s.message.substr(0, s.message.find_first_of("0123456789"));
      if (words != before)
        fmt::print("  {:.2f} s: {}\n", seconds(s.utime - start_utime()),
                   s.message.empty() ? "valid" : s.message);
      before = words;
    }
  }

  // Seconds from `cause_utime` until top first shows the sentence.
  [[nodiscard]] std::optional<double> shown_after_s(std::int64_t cause_utime,
                                                    const std::string& sentence) const {
    tools::Board top;
    for (const status_t& s : status_) {
      const double now_s = seconds(s.utime);
      top.take(s, now_s);
      if (s.utime < cause_utime) continue;
      const std::string screen = top.render(now_s, false);
      const std::size_t line = screen.find("\nreason    ");
      if (line != std::string::npos &&
          screen.substr(line + 1, screen.find('\n', line + 1) - line).find(sentence) != std::string::npos)
        return now_s - seconds(cause_utime);
    }
    return std::nullopt;
  }

  void expect_told(std::int64_t cause_utime, const std::string& sentence, double within_s = 2.0) const {
    const std::size_t why = last_line_.find("without a valid pose: ");
    ASSERT_NE(why, std::string::npos) << last_line_;
    EXPECT_NE(last_line_.find(sentence, why), std::string::npos) << last_line_;
    const std::optional<double> after_s = shown_after_s(cause_utime, sentence);
    ASSERT_TRUE(after_s) << "top never shows: " << sentence;
    fmt::print("  in top {:.2f} s after the cause, allowed {:.1f} s: {}\n", *after_s, within_s, sentence);
    EXPECT_LE(*after_s, within_s) << sentence;
    record_number("shown_after_s", *after_s);
  }

  [[nodiscard]] std::int64_t start_utime() const { return status_.front().utime; }

  const Scratch work_;
  const std::string log_ = work_.path("altered.lcm");
  std::string last_line_;
  std::vector<status_t> status_;
};

// Row by row and column by column: the mean of 2 * radius + 1 pixels.
void blur(int radius, ipc::GreyImage* image) {
  const auto run = [&](int lines, int length, int step, int line_step) {
    std::vector<int> line(static_cast<std::size_t>(length));
    for (int i = 0; i < lines; ++i) {
      std::uint8_t* first = image->pixels.data() + static_cast<std::ptrdiff_t>(i) * line_step;
      for (int k = 0; k < length; ++k)
        line[static_cast<std::size_t>(k)] = first[static_cast<std::ptrdiff_t>(k) * step];
      const auto at = [&](int k) { return line[static_cast<std::size_t>(std::clamp(k, 0, length - 1))]; };
      int sum = 0;
      for (int k = -radius; k <= radius; ++k) sum += at(k);
      for (int k = 0; k < length; ++k) {
        first[static_cast<std::ptrdiff_t>(k) * step] = static_cast<std::uint8_t>(sum / (2 * radius + 1));
        sum += at(k + radius + 1) - at(k - radius);
      }
    }
  };
  run(image->height_px, image->width_px, 1, image->width_px);
  run(image->width_px, image->height_px, image->width_px, 1);
}

// Linear between the four pixels around; the edge goes on outside.
double level_at(const ipc::GreyImage& image, double u, double v) {
  const double x = std::clamp(u, 0.0, image.width_px - 1.001),
               y = std::clamp(v, 0.0, image.height_px - 1.001);
  const int c = static_cast<int>(x), r = static_cast<int>(y);
  const double fx = x - c, fy = y - r;
  const auto at = [&](int column, int row) {
    return static_cast<double>(
        image.pixels[static_cast<std::size_t>(row) * static_cast<std::size_t>(image.width_px) +
                     static_cast<std::size_t>(column)]);
  };
  return (1 - fy) * ((1 - fx) * at(c, r) + fx * at(c + 1, r)) +
         fy * ((1 - fx) * at(c, r + 1) + fx * at(c + 1, r + 1));
}

// --- runs that cannot start

TEST_F(RecordedReasons, InTheDark) {
  GreyNoise noise(1.0);
  alter_log(recording(kKitti), log_, {.images = 30, .image = [&](int, ipc::GreyImage* image) {
                                        for (std::uint8_t& p : image->pixels) p = noise.noisy(0.03 * p);
                                      }});
  replay();
  expect_told(start_utime(), "too dark, blurred or empty: ");
}

TEST_F(RecordedReasons, BeforeABlankWall) {
  GreyNoise noise(2.0);
  alter_log(recording(kKitti), log_, {.images = 30, .image = [&](int, ipc::GreyImage* image) {
                                        for (std::uint8_t& p : image->pixels) p = noise.noisy(120.0);
                                      }});
  replay();
  expect_told(start_utime(), "too dark, blurred or empty: ");
}

TEST_F(RecordedReasons, WithALensOutOfFocus) {
  GreyNoise noise(1.0);
  alter_log(recording(kKitti), log_, {.images = 30, .image = [&](int, ipc::GreyImage* image) {
                                        blur(60, image);
                                        noise.add(image);
                                      }});
  replay();
  expect_told(start_utime(), "too dark, blurred or empty: ");
}

TEST_F(RecordedReasons, Standing) {
  GreyNoise noise(2.0);
  std::vector<std::uint8_t> first;
  alter_log(recording(kKitti), log_,
            {.first = 50, .images = 30, .image = [&](int number, ipc::GreyImage* image) {
               if (number == 0) first = image->pixels;
               image->pixels = first;
               noise.add(image);
             }});
  replay();
  expect_told(start_utime(), "waiting for motion: the camera stands");
}

// A part of one image, as a camera that turns by 0.3 rad/s sees it.
TEST_F(RecordedReasons, TurningWithoutMoving) {
  constexpr int kWidth = 640, kHeight = 300;
  constexpr double kFocal_px = 718.856, kCx_px = 607.19, kCy_px = 185.2, kTurn_rad = 0.03;
  GreyNoise noise(2.0);
  ipc::GreyImage first;
  const auto turn = [&](int number, ipc::GreyImage* image) {
    if (number == 0) first = *image;
    const Eigen::AngleAxisd turned(kTurn_rad * number - 0.2, Eigen::Vector3d::UnitY());
    ipc::GreyImage seen{kWidth, kHeight, {}};
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x) {
        const Eigen::Vector3d ray =
            turned * Eigen::Vector3d((x - 0.5 * kWidth) / kFocal_px, (y - 0.5 * kHeight) / kFocal_px, 1);
        seen.pixels.push_back(noise.noisy(
            level_at(first, kFocal_px * ray.x() / ray.z() + kCx_px, kFocal_px * ray.y() / ray.z() + kCy_px)));
      }
    *image = seen;
  };
  const auto crop = [](calibration_t* c) {
    camera_calibration_t& camera = c->cameras[0];
    camera.width = kWidth, camera.height = kHeight;
    camera.cx = 0.5 * kWidth, camera.cy = 0.5 * kHeight;
  };
  alter_log(recording(kKitti), log_, {.first = 50, .images = 25, .image = turn, .calibration = crop});
  replay();
  expect_told(start_utime(), "turning without moving");
}

// The end of the recording: the drone drifts by millimetres, too little to fix the map's unit.
TEST_F(RecordedReasons, DriftingByMillimetres) {
  alter_log(recording(kEuroc), log_, {.first = 302, .images = 38});
  replay();
  expect_told(start_utime(), "the young map's unit changes: ");
}

// More features move with the camera than with the world: that is not a camera that stands.
TEST_F(RecordedReasons, BehindALargeBonnet) {
  std::optional<Bonnet> bonnet;
  alter_log(recording(kKitti), log_, {.images = 40, .image = [&](int, ipc::GreyImage* image) {
                                        if (!bonnet)
                                          bonnet.emplace(image->width_px, image->height_px,
                                                         BonnetOptions{.share = 0.4, .noise = 4});
                                        bonnet->paint(&image->pixels);
                                      }});
  replay();
  expect_told(start_utime(), "% of the features move with the camera");
}

// --- runs that do not stay sound

// Contradictions of a map begin with its third keyframe.
TEST_F(RecordedReasons, BehindABonnet) {
  std::optional<Bonnet> bonnet;
  alter_log(recording(kKitti), log_, {.images = 17, .image = [&](int, ipc::GreyImage* image) {
                                        if (!bonnet)
                                          bonnet.emplace(image->width_px, image->height_px,
                                                         BonnetOptions{.noise = 4});
                                        bonnet->paint(&image->pixels);
                                      }});
  replay();
  expect_told(start_utime(), "% of the features move with the camera");
}

TEST_F(RecordedReasons, AStreamThatFreezes) {
  constexpr int kFrom = 41;
  std::vector<std::uint8_t> last;
  alter_log(recording(kKitti), log_, {.images = 75, .image = [&](int number, ipc::GreyImage* image) {
                                        if (number < kFrom) last = image->pixels;
                                        image->pixels = last;
                                      }});
  replay();
  expect_told(start_utime() + kFrom * kPeriod_us, "a frozen stream");
}

TEST_F(RecordedReasons, ImagesThatAreMirrored) {
  constexpr int kFrom = 40;
  alter_log(recording(kKitti), log_, {.images = kFrom + 12, .image = [&](int number, ipc::GreyImage* image) {
                                        if (number < kFrom) return;
                                        const auto width = static_cast<std::ptrdiff_t>(image->width_px);
                                        for (auto row = image->pixels.begin(); row != image->pixels.end();
                                             row += width)
                                          std::reverse(row, row + width);
                                      }});
  replay();
  expect_told(start_utime() + kFrom * kPeriod_us, "place not recognised yet");
}

// A part of an earlier image over most of the later ones, moving across.
TEST_F(RecordedReasons, ABusThatFillsTheImage) {
  constexpr int kFrom = 40;
  std::vector<std::uint8_t> bus;
  alter_log(recording(kKitti), log_,
            {.images = kFrom + 30, .image = [&](int number, ipc::GreyImage* image) {
               if (number == kFrom - 10) bus = image->pixels;
               if (number < kFrom) return;
               const auto width = static_cast<std::size_t>(image->width_px);
               const auto moved = 15 * static_cast<std::size_t>(number - kFrom);
               for (std::size_t y = 40; y < static_cast<std::size_t>(image->height_px); ++y)
                 for (std::size_t x = width / 5; x < width; ++x)
                   image->pixels[y * width + x] = bus[y * width + (x + width - moved % width) % width];
             }});
  replay();
  expect_told(start_utime() + kFrom * kPeriod_us, "the scene moves, or matches are wrong");
}

// Straight ahead no camera tells its focal length. The drive turns to the right from 5.3 s on: by 10 degrees
// until 7.5 s, by 28 until 8.7 s, by 80 until 10.6 s. The reason came at 10.4 s, 1.7 s after the first 28
// degrees. From the first degree on it is 5 s: a calibration cannot be doubted within 2 s of its use.
TEST_F(RecordedReasons, AFocalLengthThatIsWrong) {
  constexpr double kTurn_s = 8.7;
  alter_log(recording(kKitti), log_, {.images = 200, .calibration = [](calibration_t* c) {
                                        c->cameras[0].fx *= 0.9;
                                        c->cameras[0].fy *= 0.9;
                                      }});
  replay();
  expect_told(start_utime() + static_cast<std::int64_t>(1e6 * kTurn_s),
              "the images contradict the calibration");
}

}  // namespace
}  // namespace farpoint::test
