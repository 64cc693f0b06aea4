// SPDX-License-Identifier: Apache-2.0
#include "tools/evaluate/landmark_metrics.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "tools/evaluate/statistics.h"

namespace farpoint::tools {
namespace {

constexpr std::array kBinEdges_m = {0.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0, 1000.0, 2000.0};
constexpr std::array kFar_m = {50.0, 100.0, 200.0};

// A figure of each landmark that `wanted` admits.
template <typename Wanted, typename Figure>
std::vector<double> collect(const std::vector<JudgedLandmark>& landmarks, Wanted&& wanted, Figure&& figure) {
  std::vector<double> values;
  for (const JudgedLandmark& l : landmarks) {
    if (wanted(l)) values.push_back(figure(l));
  }
  return values;
}

DistanceBin measure_bin(const std::vector<JudgedLandmark>& landmarks, double from_m, double to_m) {
  // Median size of a normal deviate times this is its sigma.
  constexpr double kSigmaOfMedian = 1.4826;
  const auto wanted = [&](const JudgedLandmark& l) {
    return l.target == LandmarkTarget::kSurface && l.true_distance_m >= from_m && l.true_distance_m < to_m;
  };
  const auto of = [&](auto&& figure) { return collect(landmarks, wanted, figure); };
  const auto error = [](const JudgedLandmark& l) { return 100.0 * (l.distance_m / l.true_distance_m - 1.0); };
  const std::vector<double> sizes = of([&](const JudgedLandmark& l) { return std::abs(error(l)); });
  DistanceBin bin;
  bin.from_m = from_m;
  bin.to_m = to_m;
  bin.count = sizes.size();
  bin.error_p50_percent = percentile(sizes, 50.0);
  bin.error_p90_percent = percentile(sizes, 90.0);
  bin.bias_percent = percentile(of(error), 50.0);
  bin.claimed_percent =
      100.0 * percentile(of([](const JudgedLandmark& l) { return l.relative_sigma; }), 50.0);
  bin.sigmas =
      kSigmaOfMedian * percentile(of([](const JudgedLandmark& l) { return std::abs(l.sigmas); }), 50.0);
  bin.position_error_m = percentile(of([](const JudgedLandmark& l) { return l.position_error_m; }), 50.0);
  return bin;
}

bool has_place(const JudgedLandmark& l) {
  return l.target == LandmarkTarget::kSurface || l.target == LandmarkTarget::kOutline;
}

FarBirths measure_births(const std::vector<JudgedLandmark>& landmarks, double beyond_m) {
  const auto wanted = [&](const JudgedLandmark& l) { return has_place(l) && l.true_distance_m > beyond_m; };
  const auto median = [&](auto&& figure) { return percentile(collect(landmarks, wanted, figure), 50.0); };
  FarBirths far;
  far.beyond_m = beyond_m;
  far.count = static_cast<std::size_t>(std::count_if(landmarks.begin(), landmarks.end(), wanted));
  far.through_vmp = static_cast<std::size_t>(
      std::count_if(landmarks.begin(), landmarks.end(),
                    [&](const JudgedLandmark& l) { return wanted(l) && l.through_vmp; }));
  const auto all = std::count_if(landmarks.begin(), landmarks.end(), has_place);
  far.share_percent = 100.0 * static_cast<double>(far.count) / static_cast<double>(all);  // 0/0: NaN
  far.wait_s = median([](const JudgedLandmark& l) { return l.wait_s; });
  far.wait_m = median([](const JudgedLandmark& l) { return l.wait_m; });
  far.parallax_deg =
      median([](const JudgedLandmark& l) { return l.parallax_rad * 180.0 / std::numbers::pi; });
  far.born_at_m = median([](const JudgedLandmark& l) { return l.born_at_m; });
  return far;
}

std::string whole(double value) {
  return std::to_string(std::lround(value));
}

// A figure in a column; a dash where there is none.
std::string cell(double value, int width, int digits) {
  char text[48];
  if (std::isfinite(value))
    std::snprintf(text, sizeof text, " %*.*f", width, digits, value);
  else
    std::snprintf(text, sizeof text, " %*s", width, "-");
  return text;
}

std::string cell(const std::string& value, int width) {
  return std::string(1 + static_cast<std::size_t>(std::max<int>(0, width - static_cast<int>(value.size()))),
                     ' ') +
         value;
}

Json count_json(std::size_t n) {
  return static_cast<std::int64_t>(n);
}

}  // namespace

LandmarkMetrics measure_landmarks(const std::vector<JudgedLandmark>& landmarks) {
  LandmarkMetrics metrics;
  metrics.count = landmarks.size();
  for (const JudgedLandmark& l : landmarks) {
    metrics.on_sky += l.target == LandmarkTarget::kSky ? 1U : 0U;
    metrics.on_moving += l.target == LandmarkTarget::kMoving ? 1U : 0U;
    metrics.at_outlines += l.target == LandmarkTarget::kOutline ? 1U : 0U;
  }
  for (std::size_t i = 0; i + 1 < kBinEdges_m.size(); ++i)
    metrics.bins.push_back(measure_bin(landmarks, kBinEdges_m[i], kBinEdges_m[i + 1]));
  for (const double beyond_m : kFar_m) metrics.far.push_back(measure_births(landmarks, beyond_m));
  return metrics;
}

Json to_json(const LandmarkMetrics& metrics) {
  Json json = Json::object();
  json.set("n", count_json(metrics.count));
  json.set("on_sky", count_json(metrics.on_sky));
  json.set("on_moving", count_json(metrics.on_moving));
  json.set("at_outlines", count_json(metrics.at_outlines));
  json.set("refused", count_json(metrics.refused));
  for (const DistanceBin& bin : metrics.bins) {
    Json item = Json::object();
    item.set("n", count_json(bin.count));
    item.set("error_p50_percent", bin.error_p50_percent);
    item.set("error_p90_percent", bin.error_p90_percent);
    item.set("bias_percent", bin.bias_percent);
    item.set("claimed_sigma_percent", bin.claimed_percent);
    item.set("error_in_claimed_sigmas", bin.sigmas);
    item.set("position_error_p50_m", bin.position_error_m);
    json.set("from_" + whole(bin.from_m) + "_to_" + whole(bin.to_m) + "_m", item);
  }
  for (const FarBirths& far : metrics.far) {
    Json item = Json::object();
    item.set("n", count_json(far.count));
    item.set("through_vmp", count_json(far.through_vmp));
    item.set("share_percent", far.share_percent);
    item.set("wait_s", far.wait_s);
    item.set("wait_m", far.wait_m);
    item.set("parallax_deg", far.parallax_deg);
    item.set("born_at_m", far.born_at_m);
    json.set("over_" + whole(far.beyond_m) + "_m", item);
  }
  return json;
}

std::string landmarks_text(const std::string& run, const LandmarkMetrics& metrics) {
  std::string text = run + " landmarks: n=" + std::to_string(metrics.count) +
                     " on_sky=" + std::to_string(metrics.on_sky) +
                     " on_moving=" + std::to_string(metrics.on_moving) +
                     " at_outlines=" + std::to_string(metrics.at_outlines) + "\n";
  if (metrics.refused > 0)
    text += run + " landmarks: refused=" + std::to_string(metrics.refused) +
            ", expected a camera, pixel and time of the recording and finite numbers\n";
  const std::string lead = run + " landmarks:";
  text +=
      lead +
      "  true distance m      n  |error| p50 %  p90 %   bias %  claimed sigma %  error/claim  place p50 m\n";
  for (const DistanceBin& bin : metrics.bins) {
    if (bin.count == 0) continue;
    text += lead + cell(whole(bin.from_m) + "-" + whole(bin.to_m), 16) + cell(std::to_string(bin.count), 6) +
            cell(bin.error_p50_percent, 14, 2) + cell(bin.error_p90_percent, 6, 1) +
            cell(bin.bias_percent, 8, 2) + cell(bin.claimed_percent, 16, 2) + cell(bin.sigmas, 12, 2) +
            cell(bin.position_error_m, 12, 2) + "\n";
  }
  text += lead +
          "   made beyond m      n  share %  through VMP  after s  after m  at parallax deg  at distance m\n";
  for (const FarBirths& far : metrics.far) {
    text += lead + cell(whole(far.beyond_m), 16) + cell(std::to_string(far.count), 6) +
            cell(far.share_percent, 8, 2) + cell(std::to_string(far.through_vmp), 12) +
            cell(far.wait_s, 8, 2) + cell(far.wait_m, 8, 1) + cell(far.parallax_deg, 16, 2) +
            cell(far.born_at_m, 14, 0) + "\n";
  }
  return text;
}

}  // namespace farpoint::tools
