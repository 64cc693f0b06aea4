// SPDX-License-Identifier: Apache-2.0
// The built program: exit statuses, one line on standard error, agreement with the independent check.
#include <gtest/gtest.h>

#include <algorithm>

#include "tests/support/paths.h"
#include "tests/tools/tool_support.h"

namespace farpoint::tools {
namespace {

namespace fs = std::filesystem;

constexpr const char* kPython = "/usr/bin/python3";

std::string quoted(const fs::path& path) {
  std::string text = "'";
  return text.append(path.string()).append("'");
}

// Status 2, nothing on standard output, one line on standard error that holds `part`.
void expect_misuse(const std::string& arguments, const std::string& part) {
  const ProgramResult result = run_farpoint_program(arguments);
  EXPECT_EQ(result.status, 2) << arguments;
  EXPECT_EQ(result.out, "") << arguments;
  EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << arguments << "\n" << result.err;
  EXPECT_NE(result.err.find(part), std::string::npos) << arguments << "\n" << result.err;
}

TEST(Program, HelpTeaches) {
  for (const char* arguments :
       {"--help", "import --help", "import kitti --help", "import euroc --help", "import tum --help",
        "import kaist --help", "import zurich --help", "import images --help", "import bag --help",
        "import video --help", "export --help", "evaluate --help", "bench --help", "ctl --help",
        "top --help"}) {
    const ProgramResult result = run_farpoint_program(arguments);
    EXPECT_EQ(result.status, 0) << arguments;
    EXPECT_EQ(result.err, "") << arguments;
    EXPECT_GT(result.out.size(), 200U) << arguments;
  }
  EXPECT_NE(run_farpoint_program("evaluate --help").out.find("Examples:"), std::string::npos);
}

TEST(Program, HelpOfACommandIsItsHelp) {
  EXPECT_EQ(run_farpoint_program("help").out, run_farpoint_program("--help").out);
  for (const std::string command : {"evaluate", "import", "import video"}) {
    const ProgramResult help = run_farpoint_program("help " + command);
    EXPECT_EQ(help.status, 0) << command;
    EXPECT_EQ(help.out, run_farpoint_program(command + " --help").out) << command;
    EXPECT_NE(help.out, "");
  }
  expect_misuse("help improt", "unknown command 'improt'");
  expect_misuse("help import ros", "unknown import 'ros'");
}

TEST(Program, VersionNamesTheBuildOfBothPrograms) {
  const ProgramResult version = run_farpoint_program("--version");
  EXPECT_EQ(version.status, 0);
  EXPECT_EQ(version.out.find("farpoint 0."), 0U) << version.out;
  const std::string daemon = run_shell(test::binary_dir() + "/bin/farpointd --version").out;
  EXPECT_EQ("farpointd " + version.out.substr(9), daemon);
}

TEST(Program, WrongUseNamesTheCommandWhoseHelpExplainsIt) {
  expect_misuse("--nonsense", "(see farpoint --help)");
  expect_misuse("evaluate x.tum --nonsense", "--nonsense (see farpoint evaluate --help)");
  expect_misuse("import bag x.bag --nonsense", "--nonsense (see farpoint import bag --help)");
  expect_misuse("import bag", "(see farpoint import bag --help)");
}

TEST(Program, WrongUseIsStatusTwoAndOneLine) {
  const ScratchFolder folder;
  make_kitti(folder.path());
  put(folder / "t.tum", "0 0 0 0 0 0 0 1\n1 1 0 0 0 0 0 1\n2 2 1 0 0 0 0 1\n");
  const std::string tum = quoted(folder / "t.tum"), root = quoted(folder.path());
  expect_misuse("", "no command");
  expect_misuse("improt", "unknown command 'improt', expected one of: import");
  expect_misuse("import", "no import, expected one of: kitti, euroc, tum, kaist, zurich, images, bag, video");
  expect_misuse(
      "import ros " + root,
      "unknown import 'ros', expected one of: kitti, euroc, tum, kaist, zurich, images, bag, video");
  expect_misuse("import kitti " + root + " -o " + quoted(folder / "x.lcm"), "SEQUENCE");
  expect_misuse("import kitti " + root + " 07", "--output");
  expect_misuse("import kitti " + root + " 08 -o " + quoted(folder / "x.lcm"),
                "sequences/08: no such folder, expected one of 07");
  expect_misuse("import kitti " + root + " 07 -o " + quoted(folder / "nowhere/x.lcm"), "does not exist");
  expect_misuse("import tum " + root + " -o " + quoted(folder / "x.lcm"), "--camera");
  expect_misuse("evaluate --truth " + tum, "RUN");
  expect_misuse("evaluate " + tum + " --truth " + quoted(folder / "none.lcm"), "none.lcm");
  expect_misuse("evaluate " + tum + " --truth " + tum + " --align rigid", "sim3");
  expect_misuse("evaluate " + tum + " --truth " + tum + " --segments 1-2", "FROM:TO");
  expect_misuse("evaluate " + tum + " --truth " + tum + " --truth-point camera0", "CALIBRATION");
  expect_misuse("evaluate " + tum + " --truth " + tum + " --nonsense", "--nonsense");
  expect_misuse("export " + tum + " --truth", "LCM log");
  expect_misuse("export " + tum, "--truth or --trajectory");
  EXPECT_FALSE(fs::exists(folder / "x.lcm"));
}

// Files as Python's own writers make them.
TEST(Program, FilesOfAWrongKindAreNamedForWhatTheyAre) {
  const ScratchFolder folder;
  const std::string script =
      "import bz2, gzip, lzma, os, sqlite3, zipfile\n"
      "os.chdir(r'" +
      folder.path().string() +
      "')\n"
      "zipfile.ZipFile('a.zip', 'w').writestr('x', 'y')\n"
      "gzip.open('a.gz', 'wb').write(b'x')\n"
      "bz2.open('a.bz2', 'wb').write(b'x')\n"
      "lzma.open('a.xz', 'wb').write(b'x')\n"
      "d = sqlite3.connect('a.db3'); d.execute('create table t(x)'); d.commit()\n";
  put(folder / "make.py", script);
  ASSERT_EQ(run_shell(std::string(kPython) + " " + quoted(folder / "make.py")).status, 0);
  put(folder / "a.bag", "#ROSBAG V2.0\nrest");
  put(folder / "a.mp4", std::string("\0\0\0\x20", 4) + "ftypisom");
  put(folder / "a.jpg", make_image(".jpg", 64, 48, 0));
  put(folder / "a.png", make_image(".png", 64, 48, 0));
  put(folder / "camera.yaml", "model: pinhole-radtan\n");
  const std::vector<std::pair<std::string, std::string>> kinds = {
      {"a.zip", "a ZIP archive"}, {"a.gz", "a gzip file"},     {"a.bz2", "a bzip2 file"},
      {"a.xz", "an xz file"},     {"a.db3", "an SQLite"},      {"a.bag", "a ROS 1 bag"},
      {"a.mp4", "an MP4 or MOV"}, {"a.jpg", "a JPEG picture"}, {"a.png", "a PNG picture"}};
  for (const auto& [name, kind] : kinds) {
    const std::string file = quoted(folder / name), part = name + ": " + kind;
    expect_misuse("import kitti " + file + " 00 -o x.lcm", part);
    expect_misuse("import images " + file + " --rate 1 --camera x -o x.lcm", part);
    expect_misuse("import images " + quoted(folder.path()) + " --rate 1 --camera " + file + " -o x.lcm",
                  part);
    expect_misuse("export " + file + " --truth", part);
    expect_misuse("evaluate " + file + " --truth " + file, part);
  }
}

TEST(Program, TheFolderOfPicturesIsMade) {
  const ScratchFolder folder;
  const std::string simulate = "simulate yard --size 64x48 --duration 0.2 -o " + quoted(folder / "x.lcm");
  const fs::path pictures = folder / "new/pictures";
  EXPECT_EQ(run_farpoint_program(simulate + " --every 1 --pictures " + quoted(pictures)).status, 0);
  EXPECT_FALSE(fs::is_empty(pictures));
  expect_misuse(simulate + " --pictures " + quoted(folder / "x.lcm"), "x.lcm: cannot be made");
}

TEST(Program, ImportsExportsAndEvaluates) {
  const ScratchFolder folder;
  make_euroc(folder.path());
  const std::string log = quoted(folder / "run.lcm"), tum = quoted(folder / "truth.tum");
  const ProgramResult import = run_farpoint_program("import euroc " + quoted(folder.path()) + " -o " + log);
  EXPECT_EQ(import.status, 0);
  EXPECT_EQ(import.err, "") << "no progress where standard error is no terminal";
  EXPECT_NE(import.out.find("9 images (1 missing)"), std::string::npos) << import.out;
  EXPECT_EQ(run_farpoint_program("export " + log + " --truth -o " + tum).status, 0);
  EXPECT_NE(get(folder / "truth.tum").find("1403636579.763556 0.000000000 2.000000000 3.000000000 0.8"),
            std::string::npos);
  // Body turned by 106 degrees about x; camera 0 stands at (0.1, 0.2, 0.3) on it.
  const ProgramResult camera = run_farpoint_program("export " + log + " --truth --point camera0");
  EXPECT_NE(camera.out.find("1403636579.763556 0.100000000 1.656000000 3.108000000 0.8"), std::string::npos)
      << camera.out;
  const ProgramResult first = run_farpoint_program("export " + log + " --truth --origin first");
  EXPECT_NE(first.out.find("1403636579.763556 0.000000000 0.000000000 0.000000000 0.0"), std::string::npos)
      << first.out;
  const ProgramResult evaluation =
      run_farpoint_program("evaluate " + tum + " --truth " + log + " --align se3");
  EXPECT_EQ(evaluation.status, 0) << evaluation.err;
  EXPECT_EQ(value_of(evaluation.out, "ate_rmse_m"), "0.0000");
  EXPECT_EQ(value_of(evaluation.out, "share"), "1.0000");
  const std::string last_line =
      evaluation.out.substr(evaluation.out.rfind('\n', evaluation.out.size() - 2) + 1);
  EXPECT_TRUE(last_line.starts_with("truth ")) << last_line;
}

TEST(Program, ExpectationsDecideTheExitStatus) {
  const ScratchFolder folder;
  std::mt19937_64 random(11);
  const Trajectory truth = random_path(&random, 100, 10.0, 0.0);
  put(folder / "truth.tum", to_tum(truth));
  put(folder / "good.tum", to_tum(disturbed(truth, 1.0, 0.01, &random)));
  put(folder / "bad.tum", to_tum(disturbed(truth, 1.0, 1.0, &random)));
  const std::string command = "evaluate " + quoted(folder / "good.tum") + " " + quoted(folder / "bad.tum") +
                              " --truth " + quoted(folder / "truth.tum");
  EXPECT_EQ(
      run_farpoint_program(command + " --expect 'good.ate < 0.1 bad.ate' --expect 'good.share >= 1'").status,
      0);
  const ProgramResult broken =
      run_farpoint_program(command + " --expect 'good.share >= 1' --expect 'bad.ate <= 1.03 good.ate'");
  EXPECT_EQ(broken.status, 1);
  EXPECT_NE(broken.err.find("expectation broken: bad.ate <= 1.03 good.ate"), std::string::npos) << broken.err;
  EXPECT_EQ(run_farpoint_program(command + " --expect 'ugly.ate < 1'").status, 2);
}

// ---- against the independent check ----

bool have_check() {
  return !shared_folder().empty() && run_shell(std::string(kPython) + " -c 'import numpy'").status == 0;
}

// Every key that the check prints, as this program prints it.
void expect_agreement(const fs::path& truth, const fs::path& estimate, const std::string& options) {
  const std::string check = std::string(kPython) + " " + quoted(shared_folder() / "check" / "ate.py");
  const ProgramResult theirs =
      run_shell(check + " " + quoted(truth) + " " + quoted(estimate) + " " + options);
  ASSERT_EQ(theirs.status, 0) << theirs.err;
  const ProgramResult ours =
      run_farpoint_program("evaluate " + quoted(estimate) + " --truth " + quoted(truth) + " " + options);
  ASSERT_EQ(ours.status, 0) << ours.err;
  for (const char* key :
       {"n", "share", "path_m", "scale", "ate_rmse_m", "ate_median_m", "ate_max_m", "ate_percent"}) {
    EXPECT_EQ(value_of(ours.out, key), value_of(theirs.out, key)) << key << " " << options << "\n"
                                                                  << theirs.out << ours.out;
  }
}

class AgainstCheck : public testing::TestWithParam<std::string> {};

TEST_P(AgainstCheck, AgreesOnRandomTrajectories) {
  if (!have_check()) GTEST_SKIP() << "needs ../shared/check and python3-numpy";
  const ScratchFolder folder;
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    std::mt19937_64 random(seed);
    const double start_s = seed == 1 ? 0.0 : 1403636579.0;
    const Trajectory truth = random_path(&random, 500, 20.0, start_s);
    Trajectory estimate = disturbed(truth, 0.1 * static_cast<double>(seed), 0.5, &random);
    std::normal_distribution<double> normal;
    for (TimedPose& p : estimate.poses) p.time_s += 0.006 * normal(random);  // some beyond the tolerance
    std::sort(estimate.poses.begin(), estimate.poses.end(),
              [](const TimedPose& a, const TimedPose& b) { return a.time_s < b.time_s; });
    estimate.poses.erase(estimate.poses.begin() + 100, estimate.poses.begin() + 150);
    put(folder / "truth.tum", to_tum(truth));
    put(folder / "estimate.tum", to_tum(estimate));
    expect_agreement(folder / "truth.tum", folder / "estimate.tum", GetParam());
  }
}

TEST_P(AgainstCheck, AgreesOnRealTruth) {
  if (!have_check()) GTEST_SKIP() << "needs ../shared/check and python3-numpy";
  const ScratchFolder folder;
  std::mt19937_64 random(7);
  for (const char* name : {"kitti03_camera", "karlsruhe_gps", "euroc_camera0", "tum_rpy_camera"}) {
    const fs::path truth = shared_folder() / "check/truth" / (std::string(name) + ".tum");
    put(folder / "estimate.tum", to_tum(disturbed(read_tum(truth), 0.3, 0.05, &random)));
    expect_agreement(truth, folder / "estimate.tum", GetParam());
  }
}

INSTANTIATE_TEST_SUITE_P(Program, AgainstCheck,
                         testing::Values("--align sim3", "--align se3", "--align none",
                                         "--align sim3 --planar", "--align se3 --planar"),
                         [](const testing::TestParamInfo<std::string>& info) {
                           std::string name;
                           for (const char c : info.param)
                             name += std::isalnum(static_cast<unsigned char>(c)) ? std::string(1, c) : "";
                           return name;
                         });

TEST(Program, ShareOfAGivenNumberOfFrames) {
  const ScratchFolder folder;
  put(folder / "t.tum", "0 0 0 0 0 0 0 1\n1 1 0 0 0 0 0 1\n2 2 1 0 0 0 0 1\n");
  const ProgramResult result = run_farpoint_program("evaluate " + quoted(folder / "t.tum") + " --truth " +
                                                    quoted(folder / "t.tum") + " --frames 4");
  EXPECT_EQ(value_of(result.out, "share"), "0.7500");
}

TEST(Program, JsonIsValid) {
  if (run_shell(std::string(kPython) + " -c 'import json'").status != 0) GTEST_SKIP() << "needs python3";
  const ScratchFolder folder;
  std::mt19937_64 random(4);
  put(folder / "truth.tum", to_tum(random_path(&random, 300, 10.0, 5.0)));
  put(folder / "lo\"st.tum", "900 0 0 0 0 0 0 1\n");
  const std::string command = "evaluate " + quoted(folder / "truth.tum") + " " +
                              quoted(folder / "lo\"st.tum") + " --truth " + quoted(folder / "truth.tum") +
                              " --json --segments 0:1";
  const ProgramResult result = run_farpoint_program(command + " >" + quoted(folder / "out.json"));
  ASSERT_EQ(result.status, 0) << result.err;
  put(folder / "check.py",
      "import json, sys\n"
      "runs = json.load(open(sys.argv[1]), parse_constant=lambda c: sys.exit('not JSON: ' + c))['runs']\n"
      "assert [r['name'] for r in runs] == ['truth', 'lo\"st'], runs\n"
      "assert runs[0]['final']['n'] == 300 and abs(runs[0]['final']['scale'] - 1) < 1e-6, runs[0]\n"
      "for key in 'n share path_m scale ate_rmse_m ate_median_m ate_max_m ate_percent'.split():\n"
      "    assert isinstance(runs[0]['final'][key], (int, float)), key\n"
      "assert runs[0]['final']['rpe_translation_percent'] < 1e-3, runs[0]\n"
      "assert runs[0]['live'] is None and runs[1]['final']['ate_rmse_m'] is None and runs[1]['final']['n'] "
      "== 0, runs\n");
  const ProgramResult check =
      run_shell(std::string(kPython) + " " + quoted(folder / "check.py") + " " + quoted(folder / "out.json"));
  EXPECT_EQ(check.status, 0) << check.err << get(folder / "out.json");
}

// ---- real recordings ----

struct RealRecording {
  std::string name, arguments, truth, exported_with;
};
// NOLINTNEXTLINE(readability-identifier-naming): GoogleTest's name
void PrintTo(const RealRecording& r, std::ostream* out) {
  *out << r.name;
}

class RealImport : public testing::TestWithParam<RealRecording> {};

TEST_P(RealImport, ExportedTruthIsTheIndependentOne) {
  SKIP_WITHOUT_SHARED_DATA();
  const ScratchFolder folder;
  const RealRecording& real = GetParam();
  const std::string log = quoted(folder / "run.lcm"), exported = quoted(folder / "truth.tum");
  const std::string command = "cd " + quoted(shared_folder() / "data") + " && " + test::binary_dir() +
                              "/bin/farpoint import " + real.arguments;
  const ProgramResult import = run_shell(command + " -o " + log);
  ASSERT_EQ(import.status, 0) << import.err;
  ASSERT_EQ(
      run_farpoint_program("export " + log + " --truth " + real.exported_with + " -o " + exported).status, 0);
  const fs::path truth = shared_folder() / "check/truth" / real.truth;
  EXPECT_EQ(read_tum(folder / "truth.tum").poses.size(), read_tum(truth).poses.size());
  const ProgramResult evaluation =
      run_farpoint_program("evaluate " + exported + " --truth " + quoted(truth) + " --align none");
  EXPECT_EQ(value_of(evaluation.out, "share"), "1.0000");
  EXPECT_EQ(value_of(evaluation.out, "ate_max_m"), "0.0000");
  if (!have_check()) return;
  const ProgramResult check =
      run_shell(std::string(kPython) + " " + quoted(shared_folder() / "check/ate.py") + " " + quoted(truth) +
                " " + exported + " --align none");
  EXPECT_EQ(value_of(check.out, "ate_max_m"), "0.0000") << check.out << check.err;
}

INSTANTIATE_TEST_SUITE_P(
    Program, RealImport,
    testing::Values(RealRecording{"Kitti03", "kitti kitti 03", "kitti03_camera.tum", ""},
                    RealRecording{"Karlsruhe", "kitti karlsruhe 2010_03_09_0019", "karlsruhe_gps.tum", ""},
                    RealRecording{"EurocBody", "euroc euroc/MH_01_part", "euroc_body.tum", ""},
                    RealRecording{"EurocCamera0", "euroc euroc/MH_01_part/mav0", "euroc_camera0.tum",
                                  "--point camera0"},
                    RealRecording{"TumRpy",
                                  "tum tum/freiburg1_rpy_part --camera " + test::source_dir() +
                                      "/config/cameras/tum-freiburg1.yaml",
                                  "tum_rpy_camera.tum", ""}),
    [](const testing::TestParamInfo<RealRecording>& info) { return info.param.name; });

}  // namespace
}  // namespace farpoint::tools
