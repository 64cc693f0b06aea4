// SPDX-License-Identifier: Apache-2.0
#include "tests/image/test_images.h"

#include <opencv2/imgcodecs.hpp>
#include "tests/support/paths.h"

namespace farpoint::slam::testing {

OwnedImage read_recorded(const std::string& path) {
  const cv::Mat grey = cv::imread(test::source_dir() + "/../shared/data/" + path, cv::IMREAD_GRAYSCALE);
  if (grey.empty()) return {};
  OwnedImage image(grey.cols, grey.rows);
  for (int y = 0; y < grey.rows; ++y) std::copy_n(grey.ptr(y), grey.cols, &image.at(0, y));
  return image;
}

}  // namespace farpoint::slam::testing
