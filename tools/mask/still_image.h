// SPDX-License-Identifier: Apache-2.0
// Finds what stays in its place in the images of a moving vehicle: the bonnet, the frame of a window, dirt.
//
// The images are averaged to about 320 columns. A pixel is still where the gradients of all images agree: the
// squared length of their sum against the sum of their squared lengths is 1 for what never changes, the
// signal's share of the power for what changes by noise alone, and 1 / images for what passes by. Only images
// count that differ from the one before: a vehicle that stands shows nothing.
#pragma once

#include <cstdint>
#include <vector>

#include "ipc/image_codec.h"

namespace farpoint::tools {

// Gradients of an averaged image, grey levels a pixel of it.
struct GradientImage {
  std::vector<float> dx, dy;
};

// Memory is of one size from the construction on, however many images come.
class StillImage {
 public:
  // Fewer images that moved leave too much to chance.
  static constexpr int kLeastImages = 20;

  StillImage(int width_px, int height_px);

  // Counts an image of that size. False where it moved too little since the last one counted.
  bool add(const ipc::GreyImage& image);
  [[nodiscard]] int counted() const { return counted_; }

  // A mask of the images' size, row by row: 0 where the image is still, else 255. Flat parts that still ones
  // enclose count as still, specks do not. Precondition: an image was counted.
  [[nodiscard]] std::vector<std::uint8_t> propose() const;

 private:
  void average(const ipc::GreyImage& image);
  void differentiate();
  [[nodiscard]] bool has_moved() const;

  int width_px_, height_px_;
  int factor_;          // pixels of the image along a side of an averaged one
  int columns_, rows_;  // of averaged images
  std::vector<float> averaged_;
  GradientImage here_, last_;  // of this image, of the last one counted
  std::vector<double> sum_dx_, sum_dy_, power_;
  int counted_ = 0;
};

}  // namespace farpoint::tools
