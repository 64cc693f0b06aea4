// SPDX-License-Identifier: Apache-2.0
// Folders of pictures: order, times and their units, and what is said about wrong ones.
#include "tools/import/images.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/ipc/log_events.h"
#include "tests/tools/tool_support.h"
#include "tools/import/recording_log.h"

namespace farpoint::tools {
namespace {

namespace fs = std::filesystem;

constexpr const char* kCamera =
    "model: pinhole-radtan\nwidth_px: 64\nheight_px: 48\nfx_px: 50\nfy_px: 51\ncx_px: 31\ncy_px: 23\n"
    "distortion: []\nT_body_camera: [0,0,1,1, -1,0,0,0, 0,-1,0,0, 0,0,0,1]\n";

class ImportImages : public testing::Test {
 protected:
  ImportImages() { put(camera(), kCamera); }

  [[nodiscard]] fs::path camera() const { return root_ / "camera.yaml"; }
  [[nodiscard]] fs::path pictures() const { return root_ / "pictures"; }
  void add(const std::string& name, int shade = 0) const {
    const std::string extension = name.ends_with("png") || name.ends_with("PNG") ? ".png" : ".jpg";
    put(pictures() / name, make_image(extension, 64, 48, shade));
  }
  void add_three() const {
    for (const char* name : {"a9.png", "a10.jpg", "a011.JPG"}) add(name);
  }
  // Reads with a stamp file of this text.
  [[nodiscard]] Recording read_stamps(const std::string& text, StampUnit unit = StampUnit::kAuto,
                                      StampUnit* used = nullptr) const {
    put(root_ / "times.txt", text);
    PictureTimes times;
    times.stamps = (root_ / "times.txt").string();
    times.unit = unit;
    return read_images(pictures(), camera(), times, used);
  }
  [[nodiscard]] std::string complaint_of_stamps(const std::string& text) const {
    return complaint_of([&] { (void)read_stamps(text); });
  }
  [[nodiscard]] Recording read_rate(double rate_hz) const {
    PictureTimes times;
    times.rate_hz = rate_hz;
    return read_images(pictures(), camera(), times);
  }

  ScratchFolder root_;
};

std::vector<std::int64_t> utimes_of(const Recording& recording) {
  std::vector<std::int64_t> utimes;
  for (const RecordingImage& image : recording.images) utimes.push_back(image.utime);
  return utimes;
}

TEST_F(ImportImages, TakesPicturesInTheOrderOfTheirNumbersAtARate) {
  add_three();
  put(pictures() / "notes.txt", "no picture");
  const Recording r = read_rate(30.0);
  ASSERT_EQ(r.images.size(), 3U);
  EXPECT_EQ(r.images[0].file.filename(), "a9.png");
  EXPECT_EQ(r.images[1].file.filename(), "a10.jpg");
  EXPECT_EQ(r.images[2].file.filename(), "a011.JPG");
  EXPECT_EQ(utimes_of(r), (std::vector<std::int64_t>{0, 33'333, 66'667}));
  EXPECT_EQ(r.images[2].sequence, 2);
  EXPECT_EQ(r.body_name, "body");
  EXPECT_EQ(r.cameras[0].T_body_camera.t.x(), 1.0);
  EXPECT_NEAR(r.cameras[0].rate_hz, 30.0, 0.01);
}

TEST_F(ImportImages, NamesAreOrderedAsPeopleCount) {
  EXPECT_TRUE(name_less("a9", "a10"));
  EXPECT_TRUE(name_less("a09b", "a9c"));
  EXPECT_TRUE(name_less("a", "a1"));
  EXPECT_TRUE(name_less("1403636579763555584", "1403636579813555456"));
  EXPECT_FALSE(name_less("a10", "a9"));
  EXPECT_FALSE(name_less("a9", "a9"));
  EXPECT_NE(name_less("a01", "a1"), name_less("a1", "a01"));
}

TEST_F(ImportImages, UnderstandsStampsInEveryUnit) {
  add_three();
  const struct {
    const char* text;
    StampUnit unit;
    std::int64_t first, last;
  } kCases[] = {
      {"1403636579763555584\n1403636579813555456\n1403636579863555712\n", StampUnit::kNanoseconds,
       1403636579763556, 1403636579863556},
      {"0\n33333333\n66666667\n", StampUnit::kNanoseconds, 0, 66'667},
      {"1403636579763555\n1403636579813555\n1403636579863555\n", StampUnit::kMicroseconds, 1403636579763555,
       1403636579863555},
      {"1403636579763.5\n1403636579813.5\n1403636579863.5\n", StampUnit::kMilliseconds, 1403636579763500,
       1403636579863500},
      {"# time\n1305031102.175304\r\n1305031102.211214\r\n1305031102.243211\r\n", StampUnit::kSeconds,
       1305031102175304, 1305031102243211},
      {"0\n1\n2\n", StampUnit::kSeconds, 0, 2'000'000},
      {"0\n2\n4\n", StampUnit::kMilliseconds, 0, 4'000},
  };
  for (const auto& c : kCases) {
    StampUnit used = StampUnit::kAuto;
    const Recording r = read_stamps(c.text, StampUnit::kAuto, &used);
    EXPECT_EQ(used, c.unit) << c.text;
    ASSERT_EQ(r.images.size(), 3U) << c.text;
    EXPECT_EQ(r.images.front().utime, c.first) << c.text;
    EXPECT_EQ(r.images.back().utime, c.last) << c.text;
  }
  EXPECT_EQ(read_stamps("0\n1\n2\n", StampUnit::kMilliseconds).images.back().utime, 2'000);
}

// Seconds of 2014, five apart: by the pace alone they were milliseconds of January 1970.
TEST_F(ImportImages, RefusesAPaceThatContradictsTheDates) {
  add_three();
  const std::string text = "1403636579\n1403636584\n1403636589\n";
  const std::string said = complaint_of_stamps(text);
  EXPECT_NE(said.find("dates in s, while the pace is one in ms, expected --unit"), std::string::npos) << said;
  EXPECT_EQ(read_stamps(text, StampUnit::kSeconds).images.back().utime, 1403636589000000);
}

TEST_F(ImportImages, SaysHowManyPicturesTheStampsLeaveOut) {
  add_three();
  const Recording r = read_stamps("1.5 a10.jpg\n1.6 a9.png\n");
  ASSERT_EQ(r.notices.size(), 1U);
  EXPECT_NE(r.notices[0].find("names 2 of 3 pictures, the others were left out"), std::string::npos);
}

TEST_F(ImportImages, TakesStampsWithNamesAndCountsTheAbsent) {
  add_three();
  const Recording r = read_stamps("1.5,a10.jpg\n1.6, a9.png\n1.7,gone.png\n");
  ASSERT_EQ(r.images.size(), 2U);
  EXPECT_EQ(r.images[0].file.filename(), "a10.jpg");
  EXPECT_EQ(r.images[1].utime, 1'600'000);
  EXPECT_EQ(r.missing_images, 1U);
}

TEST_F(ImportImages, TakesTheNamesAsStamps) {
  for (const char* name : {"1403636579863555712.png", "1403636579763555584.png", "1403636579813555456.png"})
    add(name);
  PictureTimes times;
  times.stamps = "names";
  const Recording r = read_images(pictures(), camera(), times);
  EXPECT_EQ(utimes_of(r), (std::vector<std::int64_t>{1403636579763556, 1403636579813555, 1403636579863556}));
  add("cover.png");
  expect_all_in(complaint_of([&] { (void)read_images(pictures(), camera(), times); }),
                {"cover.png", "number as the stamp", "'cover'"});
}

TEST_F(ImportImages, SaysWhatIsWrongWithStamps) {
  add_three();
  expect_all_in(complaint_of_stamps("1\n2\n"), {"times.txt", "2 stamps", "3 pictures", "'stamp name'"});
  expect_all_in(complaint_of_stamps("1\nnoon\n3\n"), {"times.txt:2:", "'noon'"});
  expect_all_in(complaint_of_stamps("1\n1.5\n1.4\n"), {"times.txt:3:", "after the one before", "'1.4'"});
  expect_all_in(complaint_of_stamps("1\n1.5\n1.5\n"), {"times.txt:3:", "'1.5'"});
  expect_all_in(complaint_of_stamps("-1\n-0.5\n0\n"), {"times.txt:1:", "'-1'", "0 to 9e9 seconds"});
  expect_all_in(complaint_of([&] { (void)read_stamps("1\n1.5\n1e300\n", StampUnit::kSeconds); }),
                {"times.txt:3:", "1e300"});
  expect_all_in(complaint_of_stamps("nan\n1\n2\n"), {"times.txt:1:", "'nan'"});
  expect_all_in(complaint_of_stamps("5e30\n6e30\n7e30\n"), {"times.txt:1", "--unit"});
  expect_all_in(complaint_of_stamps("# none\n"), {"times.txt", "no stamp"});
  expect_all_in(complaint_of_stamps("1 a9.png\n2\n3 a10.jpg\n"), {"times.txt:2:", "expected 2 fields"});
  expect_all_in(complaint_of_stamps("1 b.png\n2 c.png\n"), {"times.txt", "none of the pictures"});
  expect_all_in(complaint_of_stamps("1 ../camera.yaml\n"), {"times.txt:1:", "within"});
  expect_all_in(complaint_of_stamps("1 /etc/passwd\n"), {"times.txt:1:", "within"});
}

TEST_F(ImportImages, RefusesAStampFileThatIsNone) {
  add_three();
  PictureTimes times;
  for (const auto& [file, part] : {std::pair{"/dev/zero", "text file"}, {"/nowhere", "cannot be opened"}}) {
    times.stamps = file;
    expect_all_in(complaint_of([&] { (void)read_images(pictures(), camera(), times); }), {file, part});
  }
  times.stamps = (root_ / "long.txt").string();
  put(times.stamps, "1\n");
  fs::resize_file(times.stamps, (std::uintmax_t{64} << 20) + 1);
  expect_all_in(complaint_of([&] { (void)read_images(pictures(), camera(), times); }), {"64 MiB"});
}

TEST_F(ImportImages, SaysWhatIsWrongWithTheFolder) {
  expect_all_in(complaint_of([&] { (void)read_rate(10.0); }), {"pictures", "no such folder"});
  put(pictures() / "x.bmp", "BM");
  expect_all_in(complaint_of([&] { (void)read_rate(10.0); }), {"none of its 1 files", ".jpg"});
  PictureTimes times;
  times.rate_hz = 10.0;
  expect_all_in(complaint_of([&] { (void)read_images(camera(), camera(), times); }), {"is a file"});
}

TEST_F(ImportImages, WantsOneSourceOfTimes) {
  add_three();
  for (const double rate_hz : {0.0, -1.0, 10'001.0, std::numeric_limits<double>::quiet_NaN()})
    expect_all_in(complaint_of([&] { (void)read_rate(rate_hz); }), {"--rate"});
}

TEST_F(ImportImages, PicturesOfAnotherSizeOrKindAreNamed) {
  add("a.png");
  put(pictures() / "b.png", make_image(".png", 32, 48, 0));
  expect_all_in(complaint_of([&] { write_recording(read_rate(10.0), root_ / "run.lcm"); }),
                {"b.png", "64x48", "32x48"});
  put(pictures() / "b.png", "GIF89a");
  expect_all_in(complaint_of([&] { write_recording(read_rate(10.0), root_ / "run.lcm"); }),
                {"b.png", "PNG or JPEG"});
  put(pictures() / "b.png", "");
  fs::resize_file(pictures() / "b.png", std::uintmax_t{1} << 36);
  expect_all_in(complaint_of([&] { write_recording(read_rate(10.0), root_ / "run.lcm"); }),
                {"b.png", "65536 MiB", "64 MiB"});
}

TEST_F(ImportImages, TheProgramWritesALogWithTheFilesBytes) {
  for (int i = 0; i < 3; ++i) add("f" + std::to_string(i) + ".jpg", i);
  const std::string log = (root_ / "run.lcm").string();
  const std::string command =
      "import images '" + pictures().string() + "' --camera '" + camera().string() + "' -o '" + log + "'";
  const ProgramResult done = run_farpoint_program(command + " --rate 20");
  EXPECT_EQ(done.status, 0) << done.err;
  EXPECT_NE(done.out.find("1 camera, 3 images (0 missing)"), std::string::npos) << done.out;
  int images = 0;
  for (const image_t& image : test::messages_of<image_t>(log, "CAMERA_0")) {
    EXPECT_EQ(image.utime, 50'000 * images);
    EXPECT_EQ(std::string(image.data.begin(), image.data.end()),
              get(pictures() / ("f" + std::to_string(images) + ".jpg")));
    ++images;
  }
  EXPECT_EQ(images, 3);

  put(root_ / "times.txt", "0\n50000000\n100000000\n");
  const std::string times = " --times '" + (root_ / "times.txt").string() + "'";
  const ProgramResult stamped = run_farpoint_program(command + times);
  EXPECT_EQ(stamped.status, 0) << stamped.err;
  EXPECT_NE(stamped.out.find("read as ns (20 pictures a second)"), std::string::npos) << stamped.out;
  // The pace is that of the stamps, whatever the camera file says.
  put(camera(), get(camera()) + "rate_hz: 5\n");
  EXPECT_NE(run_farpoint_program(command + times).out.find("(20 pictures a second)"), std::string::npos);
  for (const std::string& wrong : {std::string(), times + " --rate 20", times + " --unit weeks"}) {
    const ProgramResult refused = run_farpoint_program(command + wrong);
    EXPECT_EQ(refused.status, 2) << wrong;
    EXPECT_EQ(std::count(refused.err.begin(), refused.err.end(), '\n'), 1) << refused.err;
  }
}

}  // namespace
}  // namespace farpoint::tools
