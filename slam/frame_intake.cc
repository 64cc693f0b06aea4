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

std::shared_ptr<Frame> full_frame(const Camera& camera, const EstimatorConfig& config) {
  const auto features = static_cast<std::size_t>(config.extractor.features);
  auto frame = std::make_shared<Frame>();
  // Filled once, so that all its memory is touched.
  frame->set.features.resize(features);
  frame->set.descriptors.resize(features);
  frame->grid = FeatureGrid(camera.width_px(), camera.height_px(), kGridCell_px, features);
  frame->grid.build(frame->set.features);
  frame->set.features.clear();
  frame->set.descriptors.clear();
  return frame;
}

// Pyramids in use at once. Either a map is being built: its keyframes that keep theirs,
// one more until the oldest is let go, two that began it. Or one is being looked for: the initialiser's
// reference and every second one of half of its frames since. Besides the frame being tracked, the next
// keyframe and the pair of a new map; and those of a map that was given up, until mapping has let them go.
std::size_t pyramid_count(const EstimatorConfig& config) {
  constexpr std::size_t kInUse = 4, kOverlap = 4;
  const double history = static_cast<double>(Initialiser::kHistoryFrames);
  const auto looking =
      static_cast<std::size_t>(std::min(0.25 * config.initialisation.max_frames, history)) + 4;
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
  PyramidBuffer(int width_px, int height_px, const PyramidOptions& options)
      : pyramid(width_px, height_px, options), image(&pyramid) {}
  [[nodiscard]] bool extract_patch(const FeatureSet& set, std::size_t index, Patch* patch) const override {
    return image.extract_patch(set, index, patch);
  }
  [[nodiscard]] Alignment align(const Patch& host, const Eigen::Matrix2f& A,
                                const Eigen::Vector2f& predicted_px, float max_shift_px) const override {
    return image.align(host, A, predicted_px, max_shift_px);
  }
  Pyramid pyramid;
  PyramidImage image;
};

FrameIntake::FrameIntake(const EstimatorConfig& config, const Rig& rig)
    : config_(config),
      camera_(rig.cameras.front().camera),
      extractor_(camera_.width_px(), camera_.height_px(), config_.pyramid, config_.extractor),
      frames_(kFrames, [this] { return full_frame(camera_, config_); }),
      pyramids_(pyramid_count(config_), [this] {
        return std::make_shared<PyramidBuffer>(camera_.width_px(), camera_.height_px(), config_.pyramid);
      }) {}

bool FrameIntake::is_acceptable(std::int64_t utime, int camera) {
  if (camera != 0 || (any_frame_ && utime <= utime_)) return false;
  any_frame_ = true;
  utime_ = utime;
  return true;
}

template <typename Input>
std::shared_ptr<Frame> FrameIntake::take_frame(const Input& input) {
  // Frames that were given back still name their pixels.
  frames_.for_each_idle([](Frame& frame) { frame.image.reset(); });
  std::shared_ptr<Frame> frame = frames_.take();
  if (!frame) return frame;
  frame->number = next_number_++;
  frame->utime = input.utime;
  frame->sequence = input.sequence;
  frame->camera = input.camera;
  return frame;
}

std::shared_ptr<Frame> FrameIntake::take(const FrameInput& input) {
  const bool fits = input.image.data != nullptr && input.image.width_px == camera_.width_px() &&
                    input.image.height_px == camera_.height_px();
  if (!fits || !is_acceptable(input.utime, input.camera)) return {};
  std::shared_ptr<Frame> frame = take_frame(input);
  const std::shared_ptr<PyramidBuffer> pixels = pyramids_.take();
  if (!frame || !pixels) return {};
  const std::uint64_t hash = pixel_hash(input.image);
  if (std::exchange(image_hash_, hash) == hash) {
    frame->set.features.clear();
    frame->set.descriptors.clear();
    frame->grid.build(frame->set.features);
    return frame;
  }
  {
    const StageSpan span(listener_, Stage::kPyramid);
    pixels->pyramid.build(input.image);
  }
  {
    const StageSpan span(listener_, Stage::kExtraction);
    extractor_.extract(pixels->pyramid, {}, &frame->set, input.most_features);
    frame->image = pixels;
    frame->grid.build(frame->set.features);
  }
  return frame;
}

std::shared_ptr<Frame> FrameIntake::take(FeatureInput&& input) {
  if (!is_acceptable(input.utime, input.camera)) return {};
  std::shared_ptr<Frame> frame = take_frame(input);
  if (!frame) return {};
  frame->set = std::move(input.features);
  frame->image = std::move(input.image);
  frame->grid.build(frame->set.features);
  return frame;
}

void FrameIntake::release() {
  frames_ = {};
  pyramids_ = {};
}

std::vector<std::pair<std::string, std::size_t>> FrameIntake::memory_table() const {
  const Frame& frame = frames_.sample();
  const std::size_t frame_bytes = sizeof(Frame) + frame.set.features.capacity() * sizeof(Feature) +
                                  frame.set.descriptors.capacity() * sizeof(Descriptor) + frame.grid.bytes();
  return {{"pyramids", pyramids_.capacity() * pyramids_.sample().pyramid.bytes()},
          {"frames", frames_.capacity() * frame_bytes}};
}

}  // namespace farpoint::slam
