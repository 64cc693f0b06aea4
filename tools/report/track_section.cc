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

constexpr std::size_t kPicturesOfARun = 3;
constexpr std::size_t kLongestTrack = 8;  // sightings before the picture's
constexpr double kFar_m = 50.0;           // drawn as far
constexpr std::size_t kMostTracks = 400;  // more would hide the picture

struct Track {
  std::vector<Eigen::Vector2d> pixels;  // the last one is the picture's
  double distance = 0.0;
  bool through_vmp = false;
};
using TracksByTime = std::map<std::int64_t, std::vector<Track>>;

// Times of keyframes with a quarter, a half and three quarters of all sightings before them.
std::vector<std::int64_t> picture_times(const landmarks_t& landmarks) {
  std::vector<std::int64_t> all;
  for (const landmark_t& l : landmarks.landmarks)
    all.insert(all.end(), l.sighting_utime.begin(), l.sighting_utime.end());
  std::sort(all.begin(), all.end());
  std::vector<std::int64_t> times;
  for (std::size_t i = 1; i <= kPicturesOfARun && !all.empty(); ++i)
    times.push_back(all[all.size() * i / (kPicturesOfARun + 1)]);
  times.erase(std::unique(times.begin(), times.end()), times.end());
  return times;
}

TracksByTime tracks_of(const RunRecord& run) {
  TracksByTime tracks;
  for (const std::int64_t time : picture_times(*run.landmarks())) tracks[time];
  for (const landmark_t& l : run.landmarks()->landmarks) {
    for (std::size_t i = 0; i < l.sighting_utime.size(); ++i) {
      const auto found = tracks.find(l.sighting_utime[i]);
      if (found == tracks.end()) continue;
      Track track;
      for (std::size_t k = i - std::min(i, kLongestTrack); k <= i; ++k)
        track.pixels.emplace_back(l.sighting_u[k], l.sighting_v[k]);
      track.distance = run.scale() * l.distance;
      track.through_vmp = l.through_vmp != 0;
      found->second.push_back(std::move(track));
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

// Every track twice: a dark line under a light one is seen on any ground.
void draw_track(const Track& track, bool is_far, Svg* svg) {
  svg->polyline(track.pixels, "stroke=\"#000\" stroke-width=\"2.6\"");
  svg->polyline(track.pixels, is_far ? "stroke=\"#ff9d4d\" stroke-width=\"1.4\""
                                     : "stroke=\"#9fd0ff\" stroke-width=\"1.2\"");
  const Eigen::Vector2d& end = track.pixels.back();
  if (is_far)
    svg->rectangle(end - Eigen::Vector2d(3.5, 3.5), {7, 7},
                   track.through_vmp ? "fill=\"#ff7a00\" stroke=\"#000\" stroke-width=\"1\""
                                     : "fill=\"#fff\" stroke=\"#000\" stroke-width=\"1\"");
  else
    svg->circle(end, 2.2,
                track.through_vmp ? "fill=\"#ff7a00\" stroke=\"#000\" stroke-width=\"0.8\""
                                  : "fill=\"#9fd0ff\" stroke=\"#000\" stroke-width=\"0.8\"");
}

std::string picture(const RunRecord& run, std::int64_t utime, const ipc::GreyImage& image,
                    std::vector<Track> tracks) {
  const double far = run.length_unit() == "m" ? kFar_m : 1e300;
  Svg svg(image.width_px, image.height_px + 24);
  svg.jpeg(to_jpeg(image), image.width_px, image.height_px);
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
  svg.text({4, image.height_px + 17.0},
           run.name + ", " + number(seconds_of(utime) - run.start_s, 1) +
               " s: " + std::to_string(tracks.size()) + " points seen, " + std::to_string(far_count) +
               " beyond " + number(kFar_m, 0) + " m",
           Anchor::kStart, "class=\"title\"");
  return svg.finish("Feature tracks");
}

}  // namespace

std::string track_section(const Runs& runs, const std::filesystem::path& recording) {
  if (recording.empty() || !is_lcm_log(recording)) return {};
  std::vector<std::string> pictures;
  for (const RunRecord& run : runs) {
    if (run.landmarks() == nullptr) continue;
    TracksByTime tracks = tracks_of(run);
    std::vector<std::int64_t> times;
    for (const auto& [time, unused] : tracks) times.push_back(time);
    for (const auto& [time, image] : images_at(recording, times))
      pictures.push_back(picture(run, time, image, std::move(tracks[time])));
  }
  return section(
      "Feature tracks",
      "Points of the final map where keyframes saw them, with their last sightings. Circles: near. "
      "Squares: beyond 50 m, filled with orange where made through a virtual map point, else white.",
      row_of(pictures));
}

}  // namespace farpoint::tools::report
