// SPDX-License-Identifier: Apache-2.0
#include <spdlog/fmt/fmt.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <memory>
#include <optional>

#include "drivers/log/log_source.h"
#include "ipc/image_encoder.h"
#include "slam/geometry/image_mask.h"
#include "tools/commands/commands.h"
#include "tools/common/errors.h"
#include "tools/common/progress.h"
#include "tools/common/text_file.h"
#include "tools/mask/still_image.h"

namespace farpoint::tools {
namespace {

struct MaskOptions {
  std::string log, output, overlay;
  int camera = 0;
};

// What the log's images give.
struct MaskProposal {
  std::vector<std::uint8_t> mask;
  ipc::GreyImage last;  // image that was counted last
  int seen = 0, counted = 0;

  [[nodiscard]] double share() const {
    const auto masked = std::count(mask.begin(), mask.end(), std::uint8_t{0});
    return static_cast<double>(masked) / static_cast<double>(mask.size());
  }
};

MaskProposal propose(const MaskOptions& options) {
  drivers::LogSource source(options.log, ipc::kMaxImagePixels, options.camera);
  std::error_code ignored;
  const auto bytes = std::filesystem::file_size(options.log, ignored);
  Progress progress("mask", ignored ? 0 : static_cast<std::size_t>(bytes));
  std::optional<StillImage> still;
  MaskProposal result;
  drivers::LogItem item;
  ipc::GreyImage image;
  while (source.next(&item)) {
    if (item.kind != drivers::LogItemKind::kImage || item.camera != options.camera) continue;
    if (source.decode(item, &image) != ipc::ImageStatus::kOk) continue;
    if (!still) still.emplace(image.width_px, image.height_px);
    // Without a calibration in the log nothing has held the images to one size.
    if (result.counted > 0 &&
        (image.width_px != result.last.width_px || image.height_px != result.last.height_px))
      throw InputError(fmt::format("{}: images of CAMERA_{} of different sizes, expected one size",
                                   options.log, options.camera));
    ++result.seen;
    if (still->add(image)) std::swap(result.last, image);
    result.counted = still->counted();
    progress.advance(static_cast<std::size_t>(item.offset));
  }
  if (result.counted < StillImage::kLeastImages)
    throw InputError(fmt::format(
        "{}: {} of {} images of CAMERA_{} show motion, expected at least {}: a recording of a vehicle that "
        "drives",
        options.log, result.counted, result.seen, options.camera, StillImage::kLeastImages));
  result.mask = still->propose();
  return result;
}

// The image, hatched and outlined in white where it is masked.
std::vector<std::uint8_t> overlay_of(const MaskProposal& proposal) {
  constexpr int kHatch = 16, kHatchLine = 2, kOutline = 2;
  constexpr std::uint8_t kWhite = 255;
  const int width = proposal.last.width_px, height = proposal.last.height_px;
  const auto index = [width](int x, int y) {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x);
  };
  const auto masked = [&](int x, int y) {
    return x < 0 || y < 0 || x >= width || y >= height || proposal.mask[index(x, y)] == 0;
  };
  std::vector<std::uint8_t> pixels = proposal.last.pixels;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      if (!masked(x, y)) continue;
      const bool inside = masked(x - kOutline, y) && masked(x + kOutline, y) && masked(x, y - kOutline) &&
                          masked(x, y + kOutline);
      const bool line = (x + y) % kHatch < kHatchLine;
      std::uint8_t& pixel = pixels[index(x, y)];
      pixel = !inside || line ? kWhite : static_cast<std::uint8_t>(pixel / 2);
    }
  }
  return pixels;
}

void write_png(const std::string& file, const MaskProposal& of, const std::vector<std::uint8_t>& pixels) {
  const std::vector<std::uint8_t> png = ipc::encode_png({of.last.width_px, of.last.height_px, pixels});
  write_file(file, std::string(png.begin(), png.end()));
}

std::string overlay_name(const std::string& output) {
  const std::filesystem::path path(output);
  return (path.parent_path() / (path.stem().string() + ".overlay.png")).string();
}

int run_mask(const MaskOptions& options) {
  if (options.output == "-") throw InputError("mask: -o -, expected the name of a PNG file");
  const MaskProposal proposal = propose(options);
  if (proposal.share() > slam::ImageMask::kMostShare)  // farpointd refuses more
    throw InputError(fmt::format(
        "{}: {:.1f} % of the image never moves, expected at most {:.0f} %: a recording with turns",
        options.log, 100.0 * proposal.share(), 100.0 * slam::ImageMask::kMostShare));
  const std::string overlay = options.overlay.empty() ? overlay_name(options.output) : options.overlay;
  write_png(options.output, proposal, proposal.mask);
  write_png(overlay, proposal, overlay_of(proposal));
  std::printf("%s: %.1f %% of %d x %d pixels masked, by %d of %d images of CAMERA_%d; look at %s\n",
              options.output.c_str(), 100.0 * proposal.share(), proposal.last.width_px,
              proposal.last.height_px, proposal.counted, proposal.seen, options.camera, overlay.c_str());
  return kExitDone;
}

}  // namespace

void add_mask_command(CLI::App* app, Action* action) {
  const auto options = std::make_shared<MaskOptions>();
  CLI::App* command =
      app->add_subcommand("mask", "Propose a camera mask from what never moves in a recording");
  command->add_option("LOG", options->log, "Recording of a vehicle that drives, with turns")->required();
  command->add_option("-o,--output", options->output, "PNG file to write, for the key camera.mask")
      ->required();
  command->add_option("--overlay", options->overlay,
                      "Picture of the mask over an image; default: OUTPUT with .overlay.png");
  command->add_option("--camera", options->camera, "N of the channel CAMERA_N")->check(CLI::Range(0, 7));
  command->footer(
      "Masked pixels are 0, others 255. Rotor blades do move: paint them into the file by hand.\n"
      "Example:\n"
      "  farpoint mask run.lcm -o mask.png\n"
      "  farpointd --replay run.lcm --lockstep --set camera.mask=mask.png");
  command->callback([=] { *action = [=] { return run_mask(*options); }; });
}

}  // namespace farpoint::tools
