// SPDX-License-Identifier: Apache-2.0
#include "drivers/v4l2/v4l2_format.h"

#include <linux/videodev2.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>

namespace farpoint::drivers {
namespace {

struct KnownFormat {
  CameraFormat format;
  std::uint32_t code;
  int bytes_a_pixel;  // of a row of luma; 0: compressed
};
// Cheapest first.
constexpr std::array<KnownFormat, 5> kFormats = {{{CameraFormat::kGrey, V4L2_PIX_FMT_GREY, 1},
                                                  {CameraFormat::kNv12, V4L2_PIX_FMT_NV12, 1},
                                                  {CameraFormat::kYuyv, V4L2_PIX_FMT_YUYV, 2},
                                                  {CameraFormat::kRgb24, V4L2_PIX_FMT_RGB24, 3},
                                                  {CameraFormat::kMjpeg, V4L2_PIX_FMT_MJPEG, 0}}};
constexpr std::uint32_t kMaxEntries = 256;  // of one of the driver's lists
constexpr double kRateTolerance = 0.98;
constexpr const char* kNoFormat =
    "it does not give images of the calibration's size in GREY, NV12, YUYV, RGB24 or MJPEG";

struct Candidate {
  const KnownFormat* known;
  double fastest_hz, shortfall_hz;
};
// The best first.
struct Candidates {
  std::array<Candidate, kFormats.size()> all{};
  std::size_t count = 0;
};

bool is_enumerated(V4l2System* system, const V4l2Node& node, std::uint32_t code) {
  for (std::uint32_t i = 0; i < kMaxEntries; ++i) {
    v4l2_fmtdesc entry{};
    entry.index = i;
    entry.type = node.buffer_type();
    if (system->ioctl(node.fd, VIDIOC_ENUM_FMT, &entry) < 0) return false;
    if (entry.pixelformat == code) return true;
  }
  return false;
}

bool holds(const v4l2_frmsizeenum& entry, const CameraOptions& options) {
  const auto width = static_cast<std::uint32_t>(options.width_px),
             height = static_cast<std::uint32_t>(options.height_px);
  if (entry.type == V4L2_FRMSIZE_TYPE_DISCRETE)
    return entry.discrete.width == width && entry.discrete.height == height;
  const auto& s = entry.stepwise;
  const auto on_step = [](std::uint32_t value, std::uint32_t min, std::uint32_t max, std::uint32_t step) {
    return value >= min && value <= max && (step == 0 || (value - min) % step == 0);
  };
  return on_step(width, s.min_width, s.max_width, s.step_width) &&
         on_step(height, s.min_height, s.max_height, s.step_height);
}

// A driver without the list is asked for the size all the same.
bool may_have_size(V4l2System* system, const V4l2Node& node, std::uint32_t code,
                   const CameraOptions& options) {
  for (std::uint32_t i = 0; i < kMaxEntries; ++i) {
    v4l2_frmsizeenum entry{};
    entry.index = i;
    entry.pixel_format = code;
    if (system->ioctl(node.fd, VIDIOC_ENUM_FRAMESIZES, &entry) < 0) return i == 0;
    if (holds(entry, options)) return true;
    if (entry.type != V4L2_FRMSIZE_TYPE_DISCRETE) return false;
  }
  return false;
}

double rate_of(const v4l2_fract& interval) {
  return interval.numerator > 0
             ? static_cast<double>(interval.denominator) / static_cast<double>(interval.numerator)
             : 0.0;
}

// 0 where the driver does not say.
double fastest_hz(V4l2System* system, const V4l2Node& node, std::uint32_t code,
                  const CameraOptions& options) {
  double fastest = 0.0;
  for (std::uint32_t i = 0; i < kMaxEntries; ++i) {
    v4l2_frmivalenum entry{};
    entry.index = i;
    entry.pixel_format = code;
    entry.width = static_cast<std::uint32_t>(options.width_px);
    entry.height = static_cast<std::uint32_t>(options.height_px);
    if (system->ioctl(node.fd, VIDIOC_ENUM_FRAMEINTERVALS, &entry) < 0) break;
    if (entry.type != V4L2_FRMIVAL_TYPE_DISCRETE) return rate_of(entry.stepwise.min);
    fastest = std::max(fastest, rate_of(entry.discrete));
  }
  return fastest;
}

// True where the driver took format and size just so; fills the stride.
bool set_format(V4l2System* system, const V4l2Node& node, const KnownFormat& known,
                const CameraOptions& options, int* row_stride) {
  v4l2_format f{};
  f.type = node.buffer_type();
  const auto width = static_cast<std::uint32_t>(options.width_px),
             height = static_cast<std::uint32_t>(options.height_px);
  std::uint32_t stride = 0;
  bool taken = false;
  if (node.multiplanar) {
    f.fmt.pix_mp = {};
    f.fmt.pix_mp.width = width;
    f.fmt.pix_mp.height = height;
    f.fmt.pix_mp.pixelformat = known.code;
    f.fmt.pix_mp.num_planes = 1;
    if (system->ioctl(node.fd, VIDIOC_S_FMT, &f) < 0) return false;
    taken = f.fmt.pix_mp.width == width && f.fmt.pix_mp.height == height &&
            f.fmt.pix_mp.pixelformat == known.code;
    stride = f.fmt.pix_mp.plane_fmt[0].bytesperline;
  } else {
    f.fmt.pix.width = width;
    f.fmt.pix.height = height;
    f.fmt.pix.pixelformat = known.code;
    f.fmt.pix.field = V4L2_FIELD_NONE;
    if (system->ioctl(node.fd, VIDIOC_S_FMT, &f) < 0) return false;
    taken = f.fmt.pix.width == width && f.fmt.pix.height == height && f.fmt.pix.pixelformat == known.code;
    stride = f.fmt.pix.bytesperline;
  }
  const int least = options.width_px * known.bytes_a_pixel;
  *row_stride = std::max(static_cast<int>(stride), least);
  return taken;
}

// 0: unknown.
double set_rate(V4l2System* system, const V4l2Node& node, double rate_hz) {
  constexpr double kMicros = 1e6;
  v4l2_streamparm parameters{};
  parameters.type = node.buffer_type();
  if (rate_hz > 0.0) {
    parameters.parm.capture.timeperframe = {static_cast<std::uint32_t>(std::lround(kMicros / rate_hz)),
                                            static_cast<std::uint32_t>(kMicros)};
    if (system->ioctl(node.fd, VIDIOC_S_PARM, &parameters) < 0) return 0.0;
  } else if (system->ioctl(node.fd, VIDIOC_G_PARM, &parameters) < 0) {
    return 0.0;
  }
  return rate_of(parameters.parm.capture.timeperframe);
}

bool is_wanted(const KnownFormat& known, const CameraOptions& options) {
  return options.format == CameraFormat::kAuto || options.format == known.format;
}

Candidates find_candidates(V4l2System* system, const V4l2Node& node, const CameraOptions& options) {
  Candidates found;
  auto& [all, count] = found;
  for (const KnownFormat& known : kFormats) {
    if (!is_wanted(known, options) || !is_enumerated(system, node, known.code)) continue;
    if (!may_have_size(system, node, known.code, options)) continue;
    const double fastest = fastest_hz(system, node, known.code, options);
    const bool reached = OfferedFormat{known.format, fastest}.reaches(options.rate_hz);
    all[count++] = {&known, fastest, reached ? 0.0 : options.rate_hz - fastest};
  }
  // By insertion: the standard stable sort takes memory.
  for (std::size_t i = 1; i < count; ++i)
    for (std::size_t k = i; k > 0 && all[k].shortfall_hz < all[k - 1].shortfall_hz; --k)
      std::swap(all[k], all[k - 1]);
  return found;
}

}  // namespace

bool OfferedFormat::reaches(double rate_hz) const {
  return fastest_hz <= 0.0 || fastest_hz >= kRateTolerance * rate_hz;
}

std::uint32_t V4l2Node::buffer_type() const {
  return multiplanar ? V4L2_BUF_TYPE_VIDEO_CAPTURE_MPLANE : V4L2_BUF_TYPE_VIDEO_CAPTURE;
}

int identify(V4l2System* system, V4l2Node* node, const char** what) {
  v4l2_capability capability{};
  *what = "it is no V4L2 device";
  const int status = system->ioctl(node->fd, VIDIOC_QUERYCAP, &capability);
  if (status < 0) return status;
  const std::uint32_t can = (capability.capabilities & V4L2_CAP_DEVICE_CAPS) != 0 ? capability.device_caps
                                                                                  : capability.capabilities;
  node->multiplanar = (can & V4L2_CAP_VIDEO_CAPTURE) == 0;
  std::memcpy(node->driver.data(), capability.driver, node->driver.size() - 1);
  *what = "it cannot stream images (another node of the camera may)";
  const bool captures = (can & (V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_VIDEO_CAPTURE_MPLANE)) != 0;
  return captures && (can & V4L2_CAP_STREAMING) != 0 ? 0 : -ENOTSUP;
}

int find_format(V4l2System* system, const V4l2Node& node, const CameraOptions& options,
                OfferedFormat* offered, const char** what) {
  const Candidates found = find_candidates(system, node, options);
  *what = kNoFormat;
  if (found.count == 0) return -ENOTSUP;
  *offered = {found.all[0].known->format, found.all[0].fastest_hz};
  return 0;
}

int agree_on_format(V4l2System* system, const V4l2Node& node, const CameraOptions& options,
                    AgreedFormat* agreed, const char** what) {
  const Candidates found = find_candidates(system, node, options);
  for (std::size_t i = 0; i < found.count; ++i) {
    const KnownFormat& known = *found.all[i].known;
    if (!set_format(system, node, known, options, &agreed->row_stride)) continue;
    agreed->format = known.format;
    agreed->rate_hz = set_rate(system, node, options.rate_hz);
    return 0;
  }
  *what = kNoFormat;
  return -ENOTSUP;
}

}  // namespace farpoint::drivers
