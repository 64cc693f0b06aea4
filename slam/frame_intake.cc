// SPDX-License-Identifier: Apache-2.0
#include "slam/frame_intake.h"

#include <algorithm>
#include <cstring>

#include "slam/tracking/initialiser.h"

namespace farpoint::slam {

namespace {

constexpr int kGridCell_px = 24;

// Frames in use at once: the initialiser's history, or what became of it and waits for
// a pose; as many in a job that poses them; the pair of a new map, the frame being tracked and the next
// keyframe.
constexpr std::size_t kFrames = 2 * Initialiser::kHistoryFrames + 8;

FrameView full_view(const Camera& camera, std::size_t features) {
  FrameView view;
  // Filled once, so that all its memory is touched.
  view.set.features.resize(features);
  view.set.descriptors.resize(features);
  view.grid = FeatureGrid(camera.width_px(), camera.height_px(), kGridCell_px, features);
  view.grid.build(view.set.features);
  view.set.features.clear();
  view.set.descriptors.clear();
  return view;
}

std::shared_ptr<Frame> full_frame(const Rig& rig, int cameras, const EstimatorConfig& config) {
  auto frame = std::make_shared<Frame>();
  frame->views = PerCamera<FrameView>(cameras);
  frame->views[0] = full_view(rig.cameras[0].camera, static_cast<std::size_t>(config.extractor.features));
  return frame;
}

// Pyramids in use at once. Either a map is being built: its keyframes that keep theirs,
// one more until the oldest is let go, two that began it. Or one is being looked for: the initialiser's
// reference and candidates of the newer half of the time since. Besides the frame being tracked, the next
// keyframe and the pair of a new map; and those of a map that was given up, until mapping has let them go.
std::size_t pyramid_count(const EstimatorConfig& config) {
  constexpr std::size_t kInUse = 4, kOverlap = 4;
  const double history = static_cast<double>(Initialiser::kHistoryFrames);
  const auto looking =
      static_cast<std::size_t>(
          std::min(0.5 * config.initialisation.max_age_s / Initialiser::kCandidateSpacing_s, history)) +
      4;
  const std::size_t building = static_cast<std::size_t>(config.capacity.window_images) + 3;
  return std::max(looking, building) + kInUse + kOverlap;
}

// Tells images apart. Two shots of one scene differ by their noise; equal pixels are one shot sent twice.
std::uint64_t pixel_hash(const ImageView& image) {
  constexpr std::uint64_t kPrime = 0x9E3779B97F4A7C15ULL;  // odd, bits well mixed: 2^64 over the golden ratio
  const auto width = static_cast<std::size_t>(image.width_px);
  std::uint64_t hash = kPrime;
  for (int y = 0; y < image.height_px; ++y) {
    const std::uint8_t* row = image.data + static_cast<std::ptrdiff_t>(y) * image.stride_bytes;
    for (std::size_t x = 0; x < width; x += sizeof(std::uint64_t)) {
      std::uint64_t word = 0;
      std::memcpy(&word, row + x, std::min(sizeof(word), width - x));
      hash = (hash ^ word) * kPrime;
      hash ^= hash >> 32;
    }
  }
  return hash;
}

}  // namespace

// A pyramid behind the interface of a frame's image.
struct FrameIntake::PyramidBuffer final : FrameImage {
  PyramidBuffer(const RigCamera& of, const PyramidOptions& options)
      : mask(of.mask),
        pyramid(of.camera.width_px(), of.camera.height_px(), options),
        image(&pyramid, mask.get()) {}
  [[nodiscard]] bool extract_patch(const FeatureSet& set, std::size_t index, Patch* patch) const override {
    return image.extract_patch(set, index, patch);
  }
  [[nodiscard]] Alignment align(const Patch& host, const Eigen::Matrix2f& A,
                                const Eigen::Vector2f& predicted_px, float max_shift_px) const override {
    return image.align(host, A, predicted_px, max_shift_px);
  }
  [[nodiscard]] bool correlate(const Patch& host, const Eigen::Matrix2f& A,
                               std::span<const Eigen::Vector2f> pixels,
                               std::span<float> zncc) const override {
    return image.correlate(host, A, pixels, zncc);
  }
  std::shared_ptr<const ImageMask> mask;
  Pyramid pyramid;
  PyramidImage image;
};

struct FrameIntake::CameraIntake {
  CameraIntake(const RigCamera& of, const EstimatorConfig& config)
      : camera(of.camera), mask(of.mask), pyramids(pyramid_count(config), [&of, &config] {
          return std::make_shared<PyramidBuffer>(of, config.pyramid);
        }) {}

  Camera camera;
  std::shared_ptr<const ImageMask> mask;  // null: none
  SharedPool<PyramidBuffer> pyramids;
  std::uint64_t image_hash = 0;  // of the last image
};

FrameIntake::FrameIntake(const EstimatorConfig& config, const Rig& rig, int cameras)
    : config_(config),
      extractor_(rig.cameras[0].camera.width_px(), rig.cameras[0].camera.height_px(), config.pyramid,
                 config.extractor) {
  cameras_.reserve(static_cast<std::size_t>(cameras));
  for (int c = 0; c < cameras; ++c)
    cameras_.push_back(std::make_unique<CameraIntake>(rig.cameras[static_cast<std::size_t>(c)], config_));
  frames_ = SharedPool<Frame>(kFrames, [&] { return full_frame(rig, cameras, config_); });
}

FrameIntake::~FrameIntake() = default;

bool FrameIntake::takes(const CameraImage& image) const {
  if (!takes(image.camera) || image.image.data == nullptr) return false;
  const Camera& camera = cameras_[static_cast<std::size_t>(image.camera)]->camera;
  return image.image.width_px == camera.width_px() && image.image.height_px == camera.height_px();
}

bool FrameIntake::advance(std::int64_t utime) {
  if (any_frame_ && utime <= utime_) return false;
  any_frame_ = true;
  utime_ = utime;
  return true;
}

template <typename Input>
std::shared_ptr<Frame> FrameIntake::take_frame(const Input& input) {
  // Frames that were given back still name their pixels.
  frames_.for_each_idle([](Frame& frame) { frame.drop_pixels(); });
  std::shared_ptr<Frame> frame = frames_.take();
  if (!frame) return frame;
  frame->number = next_number_++;
  frame->utime = input.utime;
  frame->sequence = input.sequence;
  frame->repeats = false;
  FrameView& view = frame->views[0];
  view.set.features.clear();
  view.set.descriptors.clear();
  view.grid.build(view.set.features);
  return frame;
}

std::shared_ptr<Frame> FrameIntake::take(const FrameInput& input) {
  const CameraImage first{input.camera, input.image};
  if (input.camera != 0 || !takes(first) || !advance(input.utime)) return {};
  std::shared_ptr<Frame> frame = take_frame(input);
  if (!frame) return {};
  frame->repeats = true;
  if (!fill_view(first, input.most_features, frame.get())) return {};
  for (const CameraImage& other : input.others)
    if (other.camera > 0 && takes(other)) fill_pixels(other, frame.get());
  return frame;
}

// False where no pixels are free.
bool FrameIntake::fill_view(const CameraImage& input, int most_features, Frame* frame) {
  CameraIntake& camera = *cameras_[static_cast<std::size_t>(input.camera)];
  const std::shared_ptr<PyramidBuffer> pixels = camera.pyramids.take();
  if (!pixels) return false;
  const std::uint64_t hash = pixel_hash(input.image);
  if (std::exchange(camera.image_hash, hash) == hash) return true;
  frame->repeats = false;
  FrameView& view = frame->views[input.camera];
  {
    const StageSpan span(listener_, Stage::kPyramid);
    pixels->pyramid.build(input.image);
  }
  const StageSpan span(listener_, Stage::kExtraction);
  extractor_.extract(pixels->pyramid, camera.mask.get(), &view.set, most_features);
  view.image = pixels;
  view.grid.build(view.set.features);
  return true;
}

void FrameIntake::fill_pixels(const CameraImage& input, Frame* frame) {
  CameraIntake& camera = *cameras_[static_cast<std::size_t>(input.camera)];
  const std::uint64_t hash = pixel_hash(input.image);
  // A repeated image shows nothing of the present.
  if (std::exchange(camera.image_hash, hash) == hash) return;
  const std::shared_ptr<PyramidBuffer> pixels = camera.pyramids.take();
  if (!pixels) return;
  const StageSpan span(listener_, Stage::kPyramid);
  pixels->pyramid.build(input.image);
  frame->views[input.camera].image = pixels;
}

std::shared_ptr<Frame> FrameIntake::take(FeatureInput&& input) {
  if (!takes(input.camera) || !advance(input.utime)) return {};
  std::shared_ptr<Frame> frame = take_frame(input);
  if (!frame) return {};
  FrameView& view = frame->views[input.camera];
  view.set = std::move(input.features);
  view.image = std::move(input.image);
  view.grid.build(view.set.features);
  return frame;
}

void FrameIntake::release() {
  frames_ = {};
  for (const auto& camera : cameras_) camera->pyramids = {};
}

std::vector<std::pair<std::string, std::size_t>> FrameIntake::memory_table() const {
  const Frame& frame = frames_.sample();
  std::size_t frame_bytes = sizeof(Frame), pyramid_bytes = 0;
  for (int c = 0; c < frame.views.size(); ++c) {
    const FrameView& view = frame.views[c];
    frame_bytes += view.set.features.capacity() * sizeof(Feature) +
                   view.set.descriptors.capacity() * sizeof(Descriptor) + view.grid.bytes();
  }
  std::size_t mask_bytes = 0;
  for (const auto& camera : cameras_) {
    pyramid_bytes += camera->pyramids.capacity() * camera->pyramids.sample().pyramid.bytes();
    if (camera->mask) mask_bytes += camera->mask->bytes();
  }
  std::vector<std::pair<std::string, std::size_t>> table{{"pyramids", pyramid_bytes},
                                                         {"frames", frames_.capacity() * frame_bytes}};
  if (mask_bytes > 0) table.emplace_back("masks", mask_bytes);
  return table;
}

}  // namespace farpoint::slam
