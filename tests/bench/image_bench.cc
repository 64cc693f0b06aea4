// SPDX-License-Identifier: Apache-2.0
// Times image processing beside cv::ORB, the yardstick, on the same frames.
//   bench_image --benchmark_enable_random_interleaving=true --benchmark_repetitions=5
// p50 and p99 are thread-CPU milliseconds a frame. Recorded frames (../shared/data) where they exist, made
// ones else.
#include <benchmark/benchmark.h>
#include <time.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <opencv2/core.hpp>
#include <opencv2/features2d.hpp>

#include "slam/image/extractor.h"
#include "slam/image/kernels.h"
#include "slam/mapping/epipolar_index.h"
#include "tests/image/test_images.h"

namespace farpoint::slam {
namespace {

using testing::OwnedImage;
constexpr int kFeatures = 2000;

// Frames of KITTI's size, spread over the recording.
const std::vector<OwnedImage>& frames() {
  static const std::vector<OwnedImage> all = [] {
    std::vector<OwnedImage> images;
    for (int i = 0; i < 400; i += 20) {
      char name[64];
      std::snprintf(name, sizeof(name), "kitti/sequences/03/image_0/%06d.jpg", i);
      OwnedImage image = testing::read_recorded(name);
      if (image.width == 0) break;
      images.push_back(std::move(image));
    }
    if (images.empty()) {
      std::fprintf(stderr, "no recordings in ../shared/data: made images instead\n");
      for (std::uint64_t i = 0; i < 5; ++i) images.push_back(testing::rectangles(1242, 375, 1500, i));
    }
    return images;
  }();
  return all;
}

double thread_cpu_ms() {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) * 1e3 + static_cast<double>(t.tv_nsec) * 1e-6;
}

// Runs `work(frame)` over the frames in turn and reports percentiles of its thread-CPU time.
template <typename Work>
void run(benchmark::State& state, const Work& work) {
  std::vector<double> times;
  times.reserve(1 << 16);
  work(frames()[0]);  // warm up
  std::size_t next = 0;
  for (auto _ : state) {
    const OwnedImage& frame = frames()[next++ % frames().size()];
    const double start = thread_cpu_ms();
    work(frame);
    times.push_back(thread_cpu_ms() - start);
  }
  std::sort(times.begin(), times.end());
  state.counters["p50_ms"] = times[times.size() / 2];
  state.counters["p99_ms"] = times[times.size() * 99 / 100];
}

void cv_orb(benchmark::State& state) {
  cv::setNumThreads(1);
  const auto orb = cv::ORB::create(kFeatures);
  std::vector<cv::KeyPoint> points;
  cv::Mat descriptors;
  run(state, [&](const OwnedImage& frame) {
    const cv::Mat image(frame.height, frame.width, CV_8U, const_cast<std::uint8_t*>(frame.pixels.data()));
    orb->detectAndCompute(image, cv::noArray(), points, descriptors);
  });
}

struct Pipeline {
  Pipeline()
      : pyramid(frames()[0].width, frames()[0].height, {}),
        extractor(frames()[0].width, frames()[0].height, {}, {.features = kFeatures}) {}
  Pyramid pyramid;
  Extractor extractor;
  FeatureSet set;
};

// Pyramid, corners, orientation, descriptors: what cv::ORB does.
void pyramid_and_extract(benchmark::State& state, const char* target) {
  if (!pin_kernels(target)) {
    state.SkipWithError("this machine lacks the instruction set");
    return;
  }
  Pipeline p;
  run(state, [&](const OwnedImage& frame) {
    p.pyramid.build(frame.view());
    p.extractor.extract(p.pyramid, {}, &p.set);
  });
  state.counters["features"] = static_cast<double>(p.set.features.size());
  pin_kernels("auto");
}

void pyramid_only(benchmark::State& state) {
  Pipeline p;
  run(state, [&](const OwnedImage& frame) { p.pyramid.build(frame.view()); });
}

// A thousand alignments of a frame's patches with itself, started half a pixel off.
void align_1000(benchmark::State& state) {
  Pipeline p;
  const PyramidImage image(&p.pyramid);
  std::vector<Patch> patches;
  std::vector<Eigen::Vector2f> starts;
  p.pyramid.build(frames()[0].view());
  p.extractor.extract(p.pyramid, {}, &p.set);
  for (std::size_t i = 0; i < p.set.features.size() && patches.size() < 1000; i += 2) {
    Patch patch;
    if (!image.extract_patch(p.set, i, &patch)) continue;
    patches.push_back(patch);
    starts.emplace_back(p.set.features[i].u_px + 0.4F, p.set.features[i].v_px - 0.3F);
  }
  run(state, [&](const OwnedImage&) {
    for (std::size_t i = 0; i < patches.size(); ++i) {
      benchmark::DoNotOptimize(image.align(patches[i], Eigen::Matrix2f::Identity(), starts[i], 10));
    }
  });
  state.counters["alignments"] = static_cast<double>(patches.size());
}

// The descriptors of a frame, each against 64 of the next one's, as matching asks.
void hamming_2000x64(benchmark::State& state, const char* target) {
  if (!pin_kernels(target)) {
    state.SkipWithError("this machine lacks the instruction set");
    return;
  }
  Pipeline a, b;
  const auto extract = [](Pipeline* p, const OwnedImage& frame) {
    p->pyramid.build(frame.view());
    p->extractor.extract(p->pyramid, {}, &p->set);
  };
  extract(&a, frames()[0]);
  extract(&b, frames()[1]);
  std::vector<std::uint32_t> indices;
  for (std::uint32_t i = 0; i < 64; ++i)
    indices.push_back((i * 31) % static_cast<std::uint32_t>(b.set.features.size()));
  std::array<std::uint16_t, 64> distances{};
  run(state, [&](const OwnedImage&) {
    for (const Descriptor& d : a.set.descriptors) {
      active_kernels().hamming(d.words.data(), b.set.descriptors.front().words.data(), indices.data(), 64,
                               distances.data());
      benchmark::DoNotOptimize(distances.data());
    }
  });
  pin_kernels("auto");
}

// Every feature of a frame searched along a line of the image through the next frame: what mapping does with
// each neighbour of a keyframe.
void epipolar_2000(benchmark::State& state) {
  Pipeline a, b;
  a.pyramid.build(frames()[0].view());
  a.extractor.extract(a.pyramid, {}, &a.set);
  b.pyramid.build(frames()[1].view());
  b.extractor.extract(b.pyramid, {}, &b.set);
  const std::vector<std::uint8_t> wanted(b.set.features.size(), 1);
  const Eigen::Vector2d epipole(frames()[0].width / 2.0, frames()[0].height / 2.0);
  EpipolarIndex index;
  int found = 0;
  run(state, [&](const OwnedImage& frame) {
    found = 0;
    index.build(b.set, wanted, frame.width, frame.height);
    for (std::size_t i = 0; i < a.set.features.size(); ++i) {
      const Feature& f = a.set.features[i];
      EpipolarQuery q;
      q.from_px = Eigen::Vector2d(f.u_px, f.v_px);
      q.to_px = q.from_px + 0.5 * (q.from_px - epipole);
      q.half_width_px = 3.0F * std::pow(1.2F, static_cast<float>(f.level));
      q.min_level = f.level - 3;
      q.max_level = f.level + 3;
      q.angle_rad = f.angle_rad;
      q.max_turn_rad = 0.6F;
      q.descriptor = &a.set.descriptors[i];
      q.ratio = 0.85F;
      found += index.find(b.set, q).feature >= 0 ? 1 : 0;
    }
  });
  state.counters["found"] = found;
}

BENCHMARK(cv_orb)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(pyramid_and_extract, auto, "auto") -> Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(pyramid_and_extract, SSE4, "SSE4")->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(pyramid_and_extract, plain, "plain")->Unit(benchmark::kMillisecond);
BENCHMARK(pyramid_only)->Unit(benchmark::kMillisecond);
BENCHMARK(align_1000)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(hamming_2000x64, auto, "auto") -> Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(hamming_2000x64, plain, "plain")->Unit(benchmark::kMillisecond);
BENCHMARK(epipolar_2000)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace farpoint::slam

BENCHMARK_MAIN();
