// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <map>
#include <memory>

#include "ipc/channels.h"
#include "ipc/image_codec.h"
#include "ipc/image_encoder.h"
#include "ipc/log.h"
#include "tools/report/html.h"
#include "tools/report/sections.h"
#include "tools/report/svg.h"

namespace farpoint::tools::report {
namespace {

constexpr std::size_t kInstants = 3;
constexpr std::size_t kLongestTrack = 8;  // sightings before the picture's
constexpr double kFar_m = 50.0;           // drawn as far
constexpr std::size_t kMostTracks = 400;  // more would hide the picture

struct Track {
  std::vector<Eigen::Vector2d> pixels;  // the last one is the picture's
  double distance = 0.0;
  bool through_vmp = false;
};
using SightingsByTime = std::map<std::int64_t, std::size_t>;
// Of one picture's instant: the time of each run's own keyframe there.
using Instant = std::vector<std::int64_t>;

SightingsByTime sightings_of(const landmarks_t& landmarks) {
  SightingsByTime sightings;
  for (const landmark_t& l : landmarks.landmarks) {
    for (const std::int64_t utime : l.sighting_utime) ++sightings[utime];
  }
  return sightings;
}

// The keyframe before which a share of all sightings lies. Precondition: there are sightings.
std::int64_t time_at_share(const SightingsByTime& sightings, double share) {
  std::size_t all = 0, before = 0;
  for (const auto& [utime, n] : sightings) all += n;
  for (const auto& [utime, n] : sightings) {
    before += n;
    if (static_cast<double>(before) > share * static_cast<double>(all)) return utime;
  }
  return sightings.rbegin()->first;
}

std::int64_t nearest_time(const SightingsByTime& sightings, std::int64_t utime) {
  const auto later = sightings.lower_bound(utime);
  if (later == sightings.begin()) return later->first;
  const auto before = std::prev(later);
  if (later == sightings.end()) return before->first;
  return seconds_between(before->first, utime) <= seconds_between(utime, later->first) ? before->first
                                                                                       : later->first;
}

SightingsByTime common_to(const std::vector<SightingsByTime>& runs) {
  SightingsByTime common = runs.front();
  for (const SightingsByTime& run : runs)
    std::erase_if(common, [&](const auto& entry) { return run.count(entry.first) == 0; });
  return common;
}

// Quarters of the first run; where all runs have keyframes, at one of those.
std::vector<Instant> instants_of(const std::vector<SightingsByTime>& runs) {
  const SightingsByTime common = common_to(runs);
  std::vector<Instant> instants;
  for (std::size_t i = 1; i <= kInstants; ++i) {
    const double share = static_cast<double>(i) / (kInstants + 1);
    std::int64_t wanted = time_at_share(runs.front(), share);
    if (!common.empty()) wanted = nearest_time(common, wanted);
    Instant instant;
    instant.reserve(runs.size());
    for (const SightingsByTime& run : runs) instant.push_back(nearest_time(run, wanted));
    if (std::find(instants.begin(), instants.end(), instant) == instants.end()) instants.push_back(instant);
  }
  return instants;
}

std::vector<Track> tracks_at(const RunRecord& run, std::int64_t utime) {
  std::vector<Track> tracks;
  for (const landmark_t& l : run.landmarks()->landmarks) {
    for (std::size_t i = 0; i < l.sighting_utime.size(); ++i) {
      if (l.sighting_utime[i] != utime) continue;
      Track track;
      for (std::size_t k = i - std::min(i, kLongestTrack); k <= i; ++k)
        track.pixels.emplace_back(l.sighting_u[k], l.sighting_v[k]);
      track.distance = run.scale() * l.distance;
      track.through_vmp = l.through_vmp != 0;
      tracks.push_back(std::move(track));
    }
  }
  return tracks;
}

// The recording's images of camera 0 at the given times.
std::map<std::int64_t, ipc::GreyImage> images_at(const std::filesystem::path& recording,
                                                 const std::vector<std::int64_t>& times) {
  std::map<std::int64_t, ipc::GreyImage> images;
  ipc::LogReader reader(recording.string());
  ipc::LogEvent event;
  ipc::ImageDecoder decoder;
  while (images.size() < times.size() && reader.next(&event)) {
    if (event.channel != "CAMERA_0") continue;
    image_t message;
    if (!ipc::decode(event.data, &message) || !std::binary_search(times.begin(), times.end(), message.utime))
      continue;
    ipc::GreyImage image;
    if (decoder.decode(message, &image) == ipc::ImageStatus::kOk) images[message.utime] = std::move(image);
  }
  return images;
}

std::vector<std::uint8_t> to_jpeg(const ipc::GreyImage& image) {
  return ipc::encode_jpeg({image.width_px, image.height_px, image.pixels}, 80);
}

constexpr char kNearLine[] = "stroke=\"#9fd0ff\" stroke-width=\"1.2\"";
constexpr char kFarLine[] = "stroke=\"#ff9d4d\" stroke-width=\"1.4\"";

void draw_end(const Eigen::Vector2d& end, bool is_far, bool through_vmp, Svg* svg) {
  if (is_far)
    svg->rectangle(end - Eigen::Vector2d(3.5, 3.5), {7, 7},
                   through_vmp ? "fill=\"#ff7a00\" stroke=\"#000\" stroke-width=\"1\""
                               : "fill=\"#fff\" stroke=\"#000\" stroke-width=\"1\"");
  else
    svg->circle(end, 2.2,
                through_vmp ? "fill=\"#ff7a00\" stroke=\"#000\" stroke-width=\"0.8\""
                            : "fill=\"#9fd0ff\" stroke=\"#000\" stroke-width=\"0.8\"");
}

// Every track twice: a dark line under a light one is seen on any ground.
void draw_track(const Track& track, bool is_far, Svg* svg) {
  svg->polyline(track.pixels, "stroke=\"#000\" stroke-width=\"2.6\"");
  svg->polyline(track.pixels, is_far ? kFarLine : kNearLine);
  draw_end(track.pixels.back(), is_far, track.through_vmp, svg);
}

std::string caption(const RunRecord& run, std::int64_t utime, std::size_t points, std::size_t far_points) {
  std::string text = run.name + ", " + number(seconds_of(utime) - run.start_s, 1) +
                     " s: " + std::to_string(points) + " points seen";
  if (run.length_unit() == "m")
    text += ", " + std::to_string(far_points) + " beyond " + number(kFar_m, 0) + " m";
  return text;
}

std::string picture(const RunRecord& run, std::int64_t utime, const ipc::GreyImage& image) {
  const double far = run.length_unit() == "m" ? kFar_m : 1e300;
  Svg svg(image.width_px, image.height_px + 24);
  svg.jpeg(to_jpeg(image), image.width_px, image.height_px);
  std::vector<Track> tracks = tracks_at(run, utime);
  // Near ones first, so that the far ones stay visible.
  std::stable_sort(tracks.begin(), tracks.end(),
                   [](const Track& a, const Track& b) { return a.distance < b.distance; });
  const std::size_t step = std::max<std::size_t>(1, (tracks.size() + kMostTracks - 1) / kMostTracks);
  std::size_t far_count = 0;
  for (std::size_t i = 0; i < tracks.size(); ++i) {
    const bool is_far = tracks[i].distance > far;
    far_count += is_far ? 1U : 0U;
    if (is_far || i % step == 0) draw_track(tracks[i], is_far, &svg);
  }
  svg.text({4, image.height_px + 17.0}, caption(run, utime, tracks.size(), far_count), Anchor::kStart,
           "class=\"title\"");
  return svg.finish("Feature tracks");
}

// What the marks mean; distances only where a run has metres.
std::string legend(bool with_far) {
  struct Entry {
    bool is_far, through_vmp;
    std::string text;
  };
  const std::string far = "beyond " + number(kFar_m, 0) + " m";
  const std::string near = with_far ? "within " + number(kFar_m, 0) + " m" : "point";
  const std::vector<Entry> entries = {{false, false, near},
                                      {false, true, near + ", made through a virtual map point"},
                                      {true, false, far},
                                      {true, true, far + ", made through a virtual map point"}};
  Svg svg(1080, 26);
  double x = 8;
  for (const Entry& entry : entries) {
    if (entry.is_far && !with_far) continue;
    const Track track{{{x, 16}, {x + 10, 11}, {x + 24, 13}}, 0.0, entry.through_vmp};
    draw_track(track, entry.is_far, &svg);
    svg.text({x + 34, 17}, entry.text, Anchor::kStart);
    x += 52.0 + 6.6 * static_cast<double>(entry.text.size());
  }
  return svg.finish("Legend of the tracks");
}

std::string pictures_of(const std::vector<const RunRecord*>& runs, const Instant& instant,
                        const std::map<std::int64_t, ipc::GreyImage>& images) {
  std::vector<std::string> pictures;
  for (std::size_t i = 0; i < runs.size(); ++i) {
    const auto image = images.find(instant[i]);
    if (image != images.end()) pictures.push_back(picture(*runs[i], instant[i], image->second));
  }
  return row_of(pictures);
}

}  // namespace

std::string track_section(const Runs& runs, const std::filesystem::path& recording) {
  if (recording.empty() || !is_lcm_log(recording)) return {};
  std::vector<const RunRecord*> shown;
  std::vector<SightingsByTime> sightings;
  bool with_far = false;
  for (const RunRecord& run : runs) {
    SightingsByTime of_run = run.landmarks() != nullptr ? sightings_of(*run.landmarks()) : SightingsByTime{};
    if (of_run.empty()) continue;
    shown.push_back(&run);
    sightings.push_back(std::move(of_run));
    with_far = with_far || run.length_unit() == "m";
  }
  if (shown.empty()) return {};
  const std::vector<Instant> instants = instants_of(sightings);
  std::vector<std::int64_t> times;
  for (const Instant& instant : instants) times.insert(times.end(), instant.begin(), instant.end());
  std::sort(times.begin(), times.end());
  times.erase(std::unique(times.begin(), times.end()), times.end());
  const std::map<std::int64_t, ipc::GreyImage> images = images_at(recording, times);
  std::string pictures;
  for (const Instant& instant : instants) pictures += pictures_of(shown, instant, images);
  if (pictures.empty()) return {};
  return section(
      "Feature tracks",
      "Points of the final map where keyframes saw them, with their last sightings. Runs of one instant "
      "stand together: a keyframe that all of them have, or each run's nearest.",
      row_of({legend(with_far)}) + pictures);
}

}  // namespace farpoint::tools::report
