// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <charconv>
#include <cstdio>
#include <map>
#include <memory>
#include <set>

#include "tools/commands/commands.h"
#include "tools/common/errors.h"
#include "tools/evaluate/expectation.h"
#include "tools/evaluate/run_metrics.h"
#include "tools/evaluate/table.h"

namespace farpoint::tools {
namespace {

struct EvaluateOptions {
  std::vector<std::string> runs;
  std::string truth, align, truth_point = "auto", segments;
  std::vector<std::string> expectations;
  std::int64_t frames = 0;
  bool planar = false, json = false, without_landmarks = false;
};

const std::map<std::string, Alignment> kAlignments = {
    {"sim3", Alignment::kSim3}, {"se3", Alignment::kSe3}, {"none", Alignment::kNone}};
const std::map<std::string, TruthPoint> kTruthPoints = {
    {"auto", TruthPoint::kAuto}, {"body", TruthPoint::kBody}, {"camera0", TruthPoint::kCamera0}};

std::size_t frame_number(std::string_view text, const std::string& all) {
  std::size_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) {
    throw InputError("--segments '" + all + "': expected FROM:TO[,FROM:TO...] in frames, found '" +
                     std::string(text) + "'");
  }
  return value;
}

std::vector<FrameRange> parse_segments(const std::string& text) {
  const std::string_view all = text;
  std::vector<FrameRange> ranges;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find(',', begin), text.size());
    const std::string_view item = all.substr(begin, end - begin);
    const std::size_t colon = item.find(':');
    if (colon == std::string_view::npos) {
      throw InputError("--segments '" + text + "': expected FROM:TO[,FROM:TO...], found '" +
                       std::string(item) + "'");
    }
    ranges.push_back({frame_number(item.substr(0, colon), text), frame_number(item.substr(colon + 1), text)});
    begin = end + 1;
  }
  return ranges;
}

EvaluationOptions to_evaluation_options(const EvaluateOptions& options) {
  EvaluationOptions result;
  if (!options.align.empty()) result.alignment = kAlignments.at(options.align);
  result.planar = options.planar;
  result.truth_point = kTruthPoints.at(options.truth_point);
  if (options.frames > 0) result.frames = options.frames;
  result.segments = parse_segments(options.segments);
  return result;
}

// Runs of the same file stem are distinguished by their paths.
void make_names_unique(const std::vector<std::string>& files, std::vector<RunMetrics>* runs) {
  std::map<std::string, int> uses;
  for (const RunMetrics& run : *runs) ++uses[run.name];
  for (std::size_t i = 0; i < runs->size(); ++i) {
    if (uses[(*runs)[i].name] > 1) (*runs)[i].name = files[i];
  }
}

// True where every condition holds. Each broken one is said on standard error.
bool check_expectations(const std::vector<std::string>& conditions, const std::vector<RunMetrics>& runs) {
  std::vector<std::pair<std::string, Json>> named;
  named.reserve(runs.size());
  for (const RunMetrics& run : runs) named.emplace_back(run.name, to_json(run));
  bool all_hold = true;
  for (const std::string& condition : conditions) {
    const ExpectationResult result = check_expectation(condition, named);
    if (!result.holds) std::fprintf(stderr, "farpoint: expectation broken: %s\n", result.text.c_str());
    all_hold = all_hold && result.holds;
  }
  return all_hold;
}

void print_json(const std::vector<RunMetrics>& runs) {
  Json::Array items;
  for (const RunMetrics& run : runs) items.push_back(to_json(run));
  Json json = Json::object();
  json.set("runs", items);
  std::printf("%s\n", json.dump().c_str());
}

void print_text(const std::vector<RunMetrics>& runs) {
  for (const RunMetrics& run : runs) std::printf("%s", details_text(run).c_str());
  std::printf("\n%s", table_text(runs).c_str());
}

void require_truth_for_its_options(const EvaluateOptions& options) {
  const bool asks_for_truth =
      !options.align.empty() || options.planar || options.truth_point != "auto" || !options.segments.empty();
  if (asks_for_truth && options.truth.empty()) {
    throw InputError(
        "--align, --planar, --truth-point and --segments compare with truth, expected --truth FILE beside "
        "them");
  }
}

Truth truth_of(const EvaluateOptions& options) {
  if (options.truth.empty()) return {};
  Truth truth = read_reference(options.truth, !options.without_landmarks);
  if (!truth.is_known())
    std::fprintf(stderr, "farpoint: warning: %s: no GROUND_TRUTH messages, evaluated without truth\n",
                 options.truth.c_str());
  return truth;
}

int run_evaluate(const EvaluateOptions& options) {
  require_truth_for_its_options(options);
  const EvaluationOptions evaluation = to_evaluation_options(options);
  const Truth truth = truth_of(options);
  std::vector<RunMetrics> runs;
  for (const std::string& file : options.runs)
    runs.push_back(evaluate_run(read_run(file), truth, evaluation));
  make_names_unique(options.runs, &runs);
  options.json ? print_json(runs) : print_text(runs);
  return check_expectations(options.expectations, runs) ? kExitDone : kExitFailed;
}

}  // namespace

void add_evaluate_command(CLI::App* app, Action* action) {
  const auto options = std::make_shared<EvaluateOptions>();
  CLI::App* command =
      app->add_subcommand("evaluate", "Say how good runs are, against truth or by themselves");
  command->add_option("RUN", options->runs, "Output logs of farpointd, or TUM trajectory files")->required();
  command->add_option(
      "--truth", options->truth,
      "The recording (LCM log with GROUND_TRUTH), or a TUM file. Without it: validity, losses,\n"
      "path length, counts and times, no errors");
  command
      ->add_option(
          "--align", options->align,
          "sim3: rotation, translation, scale; se3: no scale; none. Default: se3 for a run of metric scale,\n"
          "else sim3")
      ->check(CLI::IsMember({"sim3", "se3", "none"}));
  command->add_flag("--planar", options->planar, "Absolute error and alignment in x and y of the truth only");
  command->add_flag("--json", options->json, "Machine-readable, on one line");
  command
      ->add_option(
          "--truth-point", options->truth_point,
          "Which point of the vehicle is compared: body, camera0 (the truth is moved there by the log's\n"
          "extrinsics), or auto (default): camera0 where the run's scale is unknown, since its body then\n"
          "stands at camera 0, else body. A TUM run aligned by sim3 counts as of unknown scale")
      ->check(CLI::IsMember({"auto", "body", "camera0"}));
  command->add_flag("--without-landmarks", options->without_landmarks,
                    "Do not judge landmarks by a simulated recording's world (it is made again, which takes\n"
                    "some seconds)");
  command
      ->add_option("--frames", options->frames,
                   "Frames of the recording, for the share (default: from the truth's log)")
      ->check(CLI::PositiveNumber);
  command->add_option(
      "--segments", options->segments,
      "FROM:TO[,FROM:TO...] in frames, TO not included: the scale of each stretch of the final\n"
      "trajectory, aligned by itself, and its ratio to the first one's");
  command
      ->add_option(
          "--expect", options->expectations,
          "Condition 'NAME.METRIC OP [FACTOR] NAME.METRIC' or 'NAME.METRIC OP NUMBER', repeatable; exit\n"
          "status 1 where one is broken. NAME is a run's file stem, OP one of < <= > >= ==, METRIC ate,\n"
          "live_ate, a key of 'final', or a dotted path into --json. A missing figure breaks it")
      ->expected(1)
      ->take_all();
  command->footer(
      "Pairs each pose with the truth nearest in time (at most 20 ms), aligns (Umeyama), and prints for each "
      "run the\n"
      "details, then one table with one row a run, the last run's last.\n"
      "  final  every frame's pose after the last optimisation      live  as published when the frame came\n"
      "  share  poses with truth, of all frames of the recording    ATE   RMS position error\n"
      "  CPU time of tracking: image to pose; of frame, where the run did not measure tracking alone: with "
      "mapping\n"
      "  RPE    over 100, 200 .. 800 m of path, and over one second (truth interpolated)\n"
      "  depth  when a point was made; distance: over all observations of the final map; metres by the "
      "alignment\n"
      "  points landmarks with a depth, of the map with most frames; 'all maps' counts every map's, and "
      "virtual\n"
      "         map points (landmarks without a depth) apart. depth counts those with a sigma under 30 %\n"
      "  VMP %  points made through a virtual map point, of all points made\n"
      "  blind  longest time without a new valid pose after the first one; path: the estimate's own length, "
      "in\n"
      "         map units where the scale is unknown\n"
      "  landmarks  against a simulated recording's world: distance from the camera that first saw each, in\n"
      "         metres by the scale of the six seconds around; error/claim is 1 where sigmas are honest\n"
      "Examples:\n"
      "  farpoint evaluate run.lcm\n"
      "  farpoint evaluate run.lcm --truth kitti03.lcm\n"
      "  farpoint evaluate baseline.lcm vmp.lcm --truth kitti03.lcm --segments 0:70,110:400\n"
      "  farpoint evaluate baseline.lcm vmp.lcm --truth kitti03.lcm --expect 'vmp.ate <= 1.03 baseline.ate' "
      "\\\n"
      "      --expect 'vmp.final.share >= 0.98'\n"
      "  farpoint evaluate final.tum --truth truth.tum --align se3 --json");
  command->callback([=] { *action = [=] { return run_evaluate(*options); }; });
}

}  // namespace farpoint::tools
