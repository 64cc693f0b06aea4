// Two cameras' images matched by time. An image whose partner does not come goes on alone, and is counted:
// the frame is then monocular. Fixed memory, no lock, no clock of its own; whoever owns it calls from one
// thread.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

namespace farpoint::drivers {

struct StereoOptions {
  // Largest distance of partners. Below half a frame period, or it is not clear who belongs to whom.
  std::int64_t tolerance_us = 5'000;
  // How long after its arrival an image waits for a partner of which nothing is known yet.
  std::int64_t patience_us = 20'000;
};

// One image of one camera; the pixels lie where its owner knows by the slot.
struct StereoImage {
  std::int64_t utime = 0;  // mid-exposure
  std::uint32_t slot = 0;
};

// Both, or one alone.
struct StereoFrame {
  std::optional<StereoImage> left, right;
  [[nodiscard]] bool is_pair() const { return left && right; }
  [[nodiscard]] std::int64_t utime() const { return left ? left->utime : right->utime; }
};

struct StereoCounts {
  std::int64_t pairs = 0, left_alone = 0, right_alone = 0;
  // Not taken: a time not after the one before it, or not after a frame that has gone on already.
  std::int64_t late = 0;
};

class StereoPairing {
 public:
  enum class Side : std::uint8_t { kLeft, kRight };

  explicit StereoPairing(const StereoOptions& options) : options_(options) {}

  // An image has come at `now_us`, by the clock of the images. False where it cannot be used (counted): its
  // slot is the caller's again. Precondition: what take() has to give was taken since the last put().
  [[nodiscard]] bool put(Side side, const StereoImage& image, std::int64_t now_us);
  // The next frame, in the order of their times; false where none is decided. Call again after due_us().
  [[nodiscard]] bool take(std::int64_t now_us, StereoFrame* frame);
  // When an image that waits will wait no longer; nothing: none waits.
  [[nodiscard]] std::optional<std::int64_t> due_us() const;
  // A camera that is known to be away is not waited for.
  void set_away(Side side, bool away) { queue(side).away = away; }

  [[nodiscard]] const StereoCounts& counts() const { return counts_; }

 private:
  static constexpr std::size_t kWaiting = 8;  // of one side: more than any patience holds

  struct Waiting {
    StereoImage image;
    std::int64_t came_us = 0;
  };
  struct Queue {
    std::array<Waiting, kWaiting> images{};
    std::size_t first = 0, count = 0;
    std::optional<std::int64_t> last_utime;
    bool away = false;

    [[nodiscard]] bool is_full() const { return count == kWaiting; }
    [[nodiscard]] const Waiting* front() const { return count > 0 ? &images.at(first) : nullptr; }
    void push(const Waiting& image) { images.at((first + count++) % kWaiting) = image; }
    StereoImage pop();
  };

  [[nodiscard]] Queue& queue(Side side) { return side == Side::kLeft ? left_ : right_; }
  [[nodiscard]] bool waits_in_vain(const Queue& own, const Queue& other, std::int64_t now_us) const;
  [[nodiscard]] StereoFrame decide_both();
  void count(const StereoFrame& frame);

  StereoOptions options_;
  Queue left_, right_;
  std::optional<std::int64_t> gone_utime_;  // of the last frame that was given out
  StereoCounts counts_;
};

}  // namespace farpoint::drivers
