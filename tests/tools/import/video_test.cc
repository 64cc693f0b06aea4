// SPDX-License-Identifier: Apache-2.0
// Videos through programs with the names of ffprobe and ffmpeg, which say what the test tells them to; and
// through the real ones where they are installed.
#include "tools/import/video.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <cstdlib>

#include "ipc/image_codec.h"
#include "tests/ipc/log_events.h"
#include "tests/tools/tool_support.h"

namespace farpoint::tools {
namespace {

namespace fs = std::filesystem;

constexpr const char* kCamera =
    "model: pinhole-radtan\nwidth_px: 64\nheight_px: 48\nfx_px: 50\nfy_px: 51\ncx_px: 31\ncy_px: 23\n"
    "distortion: []\n";

class ImportVideo : public testing::Test {
 protected:
  ImportVideo() {
    put(root_ / "camera.yaml", kCamera);
    put(video(), std::string("\0\0\0\x20", 4) + "ftypisom");
    set("ffprobe",
        "printf 'width=64\\nheight=48\\n'; for t in 0.000000 0.040000 0.080000; do echo "
        "best_effort_timestamp_time=$t; done");
    // Frame i is all of the value 65 + i.
    set("ffmpeg", "for c in A B C; do head -c 3072 /dev/zero | tr '\\0' $c; done");
  }

  [[nodiscard]] fs::path video() const { return root_ / "a drive.mp4"; }
  // A program that notes its arguments, then does what the script says.
  void set(const std::string& name, const std::string& script) const {
    const fs::path file = root_ / ("bin/" + name);
    std::string text = "#!/bin/sh\necho \"$@\" > '";
    text.append((root_ / (name + ".arguments")).string()).append("'\n").append(script).append("\n");
    put(file, text);
    fs::permissions(file, fs::perms::owner_all);
  }
  // `before` stands before the command.
  [[nodiscard]] ProgramResult import(const std::string& more = "", const std::string& before = "") const {
    const char* const path = std::getenv("PATH");
    return import_with_path((root_ / "bin").string().append(":").append(path != nullptr ? path : ""), more,
                            before);
  }
  [[nodiscard]] ProgramResult import_with_path(const std::string& path, const std::string& more,
                                               const std::string& before = "") const {
    std::string command = before;
    command.append(" PATH='").append(path).append("' ").append(program());
    command.append(" import video '").append(video().string()).append("' --camera '");
    command.append((root_ / "camera.yaml").string()).append("' -o '");
    command.append((root_ / "run.lcm").string()).append("' ").append(more);
    return run_shell(command);
  }
  [[nodiscard]] std::vector<image_t> images() const {
    return test::messages_of<image_t>((root_ / "run.lcm").string(), "CAMERA_0");
  }
  [[nodiscard]] static ipc::GreyImage grey_of(const image_t& image) {
    ipc::ImageDecoder decoder;
    ipc::GreyImage grey;
    EXPECT_EQ(decoder.decode(image, &grey), ipc::ImageStatus::kOk);
    return grey;
  }
  void expect_refused(const std::vector<std::string>& parts, const std::string& more = "") const {
    const ProgramResult result = import(more);
    EXPECT_NE(result.status, 0);
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    expect_all_in(result.err, parts);
    EXPECT_FALSE(fs::exists(root_ / "run.lcm"));
  }

  ScratchFolder root_;
};

TEST_F(ImportVideo, FramesAndTheirTimesComeFromTheTwoPrograms) {
  const ProgramResult done = import();
  ASSERT_EQ(done.status, 0) << done.err;
  const std::vector<image_t> frames = images();
  ASSERT_EQ(frames.size(), 3U);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(frames[i].utime, static_cast<std::int64_t>(40'000 * i));
    EXPECT_EQ(frames[i].pixel_format, image_t::PIXEL_FORMAT_PNG);
    EXPECT_EQ(grey_of(frames[i]).pixels,
              std::vector<std::uint8_t>(64 * 48, static_cast<std::uint8_t>('A' + i)));
  }
  // The name is an address of a file, not an option or another protocol.
  for (const char* name : {"ffprobe.arguments", "ffmpeg.arguments"})
    EXPECT_NE(get(root_ / name).find("file:" + video().string()), std::string::npos) << get(root_ / name);
}

TEST_F(ImportVideo, APartSkipsTheFramesBeforeIt) {
  ASSERT_EQ(import("--first 1 --frames 1 --rate 10").status, 0);
  const std::vector<image_t> frames = images();
  ASSERT_EQ(frames.size(), 1U);
  EXPECT_EQ(frames[0].utime, 100'000) << "by --rate";
  const ipc::GreyImage grey = grey_of(frames[0]);
  ASSERT_FALSE(grey.pixels.empty());
  EXPECT_EQ(grey.pixels[0], 'B');
}

TEST_F(ImportVideo, SaysWhatIsWrong) {
  set("ffprobe", "echo 'moov atom not found' >&2; exit 1");
  expect_refused({"a drive.mp4", "moov atom not found"});
  set("ffprobe", "printf 'width=64\\nheight=48\\nbest_effort_timestamp_time=N/A\\n'");
  expect_refused({"frame 0 has no time", "--rate"});
  set("ffprobe",
      "printf 'width=64\\nheight=48\\nbest_effort_timestamp_time=1\\nbest_effort_timestamp_time=1\\n'");
  expect_refused({"frame 1 is not after", "--rate"});
  set("ffprobe", "printf 'width=32\\nheight=48\\nbest_effort_timestamp_time=1\\n'");
  expect_refused({"32x48", "expected 64x48", "camera.yaml"});
  set("ffprobe", "printf 'width=2000000000\\nheight=2000000000\\nbest_effort_timestamp_time=1\\n'");
  expect_refused({"2000000000x2000000000", "16384"});
  set("ffprobe", "yes best_effort_timestamp_time=1");
  expect_refused({"more than two million frames"});
  expect_refused({"--rate"}, "--rate -3");
}

TEST_F(ImportVideo, SaysWhatIsWrongWithTheDecoder) {
  set("ffmpeg", "head -c 4000 /dev/zero; echo 'Invalid data found' >&2; exit 1");
  expect_refused({"a drive.mp4", "ends before frame 1", "Invalid data found"});
  set("ffprobe", "exec nowhere-to-be-found");
  expect_refused({"expected a video that ffprobe reads"});
}

// Then the times are not those of the frames.
TEST_F(ImportVideo, MoreFramesThanCountedAreRefused) {
  set("ffmpeg", "for c in A B C D; do head -c 3072 /dev/zero | tr '\\0' $c; done");
  expect_refused({"a drive.mp4", "more frames than the 3 that ffprobe counted"});
  set("ffmpeg", "for c in A B C; do head -c 3072 /dev/zero | tr '\\0' $c; done; echo");
  expect_refused({"more frames than the 3"});
  EXPECT_EQ(import("--frames 2").status, 0) << "the end is not decoded";
}

TEST_F(ImportVideo, AnIgnoredSigchldHidesNoStatus) {
  const ProgramResult done = import("", "trap '' CHLD; exec env");
  EXPECT_EQ(done.status, 0) << done.err;
}

TEST_F(ImportVideo, APipeIsNotWaitedFor) {
  fs::remove(video());
  ASSERT_EQ(mkfifo(video().c_str(), 0600), 0);
  set("ffprobe", "cat '" + video().string() + "'");
  const ProgramResult result = import("", "exec timeout 20 env");
  EXPECT_EQ(result.status, 2);
  expect_all_in(result.err, {"a drive.mp4", "is a pipe", "expected a video file"});
}

// ---- raw MJPEG streams ----

TEST_F(ImportVideo, ARawStreamOfJpegNeedsARate) {
  put(video(), make_image(".jpg", 64, 48, 0).append(make_image(".jpg", 64, 48, 1)));
  expect_refused({"has no times", "--rate HZ", "import images"});
  ASSERT_EQ(import("--rate 10").status, 0);
  EXPECT_EQ(images().at(2).utime, 200'000);
  for (const char* name : {"ffprobe.arguments", "ffmpeg.arguments"})
    EXPECT_NE(get(root_ / name).find("-f mjpeg"), std::string::npos)
        << "read as what it is, not as a picture";
}

TEST_F(ImportVideo, APictureIsNoVideo) {
  put(video(), make_image(".jpg", 64, 48, 0));
  set("ffprobe", "printf 'width=64\\nheight=48\\nbest_effort_timestamp_time=0\\n'");
  expect_refused({"a JPEG picture, expected a video", "import images"}, "--rate 10");
}

TEST_F(ImportVideo, TheRealProgramsReadARawStreamOfJpeg) {
  if (run_shell("ffmpeg -version").status != 0) GTEST_SKIP() << "no ffmpeg";
  std::string stream;
  for (int i = 0; i < 30; ++i) stream += make_image(".jpg", 64, 48, 4 * i);
  put(video(), stream);
  fs::remove_all(root_ / "bin");
  const ProgramResult done = import("--rate 5");
  ASSERT_EQ(done.status, 0) << done.err;
  const std::vector<image_t> frames = images();
  ASSERT_EQ(frames.size(), 30U);
  for (std::size_t i = 0; i < frames.size(); ++i) {
    EXPECT_EQ(frames[i].utime, static_cast<std::int64_t>(200'000 * i));
    EXPECT_NEAR(grey_of(frames[i]).pixels.at(64 * 20 + 20), 40.0 + 4.0 * static_cast<double>(i), 3.0) << i;
  }
  put(video(), make_image(".jpg", 64, 48, 0));
  fs::remove(root_ / "run.lcm");
  expect_refused({"a JPEG picture, expected a video", "import images"}, "--rate 10");
}

TEST_F(ImportVideo, WithoutFfmpegItNamesThePackage) {
  const ProgramResult result = import_with_path((root_ / "empty").string(), "");
  EXPECT_EQ(result.status, 2);
  expect_all_in(result.err, {"ffprobe", "package ffmpeg"});
}

TEST_F(ImportVideo, FilesThatAreNoVideosAreNamed) {
  put(video(), "#ROSBAG V2.0\n");
  expect_refused({"a ROS 1 bag", "expected a video", "import bag"});
  fs::remove(video());
  expect_refused({"no such file"});
}

TEST_F(ImportVideo, TheRealProgramsGiveTheFramesThatWentIn) {
  if (run_shell("ffmpeg -version").status != 0) GTEST_SKIP() << "no ffmpeg";
  for (int i = 0; i < 5; ++i) put(root_ / (std::to_string(i) + ".png"), make_image(".png", 64, 48, 10 * i));
  const ProgramResult made = run_shell("ffmpeg -v error -y -framerate 25 -i '" + (root_ / "%d.png").string() +
                                       "' -c:v ffv1 -pix_fmt gray -f matroska '" + video().string() + "'");
  ASSERT_EQ(made.status, 0) << made.err;
  fs::remove_all(root_ / "bin");
  const ProgramResult done = import();
  ASSERT_EQ(done.status, 0) << done.err;
  const std::vector<image_t> frames = images();
  ASSERT_EQ(frames.size(), 5U);
  for (std::size_t i = 0; i < 5; ++i) {
    EXPECT_EQ(frames[i].utime, static_cast<std::int64_t>(40'000 * i));
    const ipc::GreyImage grey = grey_of(frames[i]);
    ASSERT_EQ(grey.pixels.size(), std::size_t{64 * 48});
    for (std::size_t k = 0; k < grey.pixels.size(); ++k)
      ASSERT_EQ(grey.pixels[k], static_cast<std::uint8_t>(k % 64 + k / 64 + 10 * i)) << i << " " << k;
  }
}

// Cameras' H.264 has luma of 16 to 235.
TEST_F(ImportVideo, TheRealProgramsWidenLimitedRangeAndKeepFullRange) {
  if (run_shell("ffmpeg -version").status != 0) GTEST_SKIP() << "no ffmpeg";
  const std::string raw = (root_ / "raw").string();
  put(raw, std::string(64 * 24, '\x10') + std::string(64 * 24, '\xeb') + std::string(64 * 24, '\x80'));
  fs::remove_all(root_ / "bin");
  for (const auto& [range, black, white] : {std::tuple{"tv", 0, 255}, {"pc", 16, 235}}) {
    const ProgramResult made = run_shell(
        "ffmpeg -v error -y -f rawvideo -pix_fmt yuv420p -s 64x48 -color_range " + std::string(range) +
        " -i '" + raw + "' -c:v ffv1 -color_range " + range + " -f matroska '" + video().string() + "'");
    ASSERT_EQ(made.status, 0) << made.err;
    const ProgramResult done = import();
    ASSERT_EQ(done.status, 0) << done.err;
    const ipc::GreyImage grey = grey_of(images().at(0));
    EXPECT_EQ(grey.pixels.front(), black) << range;
    EXPECT_EQ(grey.pixels.back(), white) << range;
  }
}

// ffmpeg follows the names in a playlist: the file itself would choose what is read.
TEST_F(ImportVideo, APlaylistIsNoVideo) {
  if (run_shell("ffmpeg -version").status != 0) GTEST_SKIP() << "no ffmpeg";
  put(root_ / "0.png", make_image(".png", 64, 48, 10));
  const ProgramResult made = run_shell("ffmpeg -v error -y -i '" + (root_ / "0.png").string() +
                                       "' -c:v ffv1 -f matroska '" + (root_ / "other.mkv").string() + "'");
  ASSERT_EQ(made.status, 0) << made.err;
  fs::remove_all(root_ / "bin");
  put(video(), "ffconcat version 1.0\nfile other.mkv\n");
  expect_refused({video().string()});
}

}  // namespace
}  // namespace farpoint::tools
