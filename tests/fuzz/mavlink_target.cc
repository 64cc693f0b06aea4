// SPDX-License-Identifier: Apache-2.0
// Bytes of an autopilot's port into the MAVLink parser.
#include <algorithm>

#include "ipc/mavlink/messages.h"
#include "tests/fuzz/targets.h"
#include "tests/support/mavlink_stream.h"

namespace farpoint::fuzz {
namespace {

using ipc::mavlink::Parser;
using ipc::mavlink::Received;
using test::parsed;

constexpr ipc::mavlink::Timesync kTimesync{4, 5, 6, 7};
constexpr ipc::mavlink::Sender kSender{1, 2};

ByteView good_frame() {
  static const ipc::mavlink::Frame frame = encode(kTimesync, kSender, 3);
  return frame.bytes();
}

bool same(const Received& a, const Received& b) {
  return a.id == b.id && a.sender.system == b.sender.system && a.sender.component == b.sender.component &&
         a.payload == b.payload;
}

bool is_timesync(const Received& received) {
  return received.id == ipc::mavlink::kTimesync.id;
}

// What is read can be sent, and is then read the same.
void check_timesync(const Received& received) {
  const ipc::mavlink::Timesync timesync = decode_timesync(received);
  Parser parser;
  const std::vector<Received> again = parsed(&parser, encode(timesync, received.sender, 0).bytes(), 64);
  require(again.size() == 1 && is_timesync(again[0]), "an encoded message is read");
  const ipc::mavlink::Timesync same_again = decode_timesync(again[0]);
  require(same_again.tc1_ns == timesync.tc1_ns && same_again.ts1_ns == timesync.ts1_ns &&
              same_again.target_system == timesync.target_system &&
              same_again.target_component == timesync.target_component,
          "an encoded message is read the same");
}

// However much the bytes before promised, it is forgotten after the longest frame.
void check_recovery(Parser* parser) {
  Bytes good;
  while (good.size() <= 2 * ipc::mavlink::kMostFrame)
    good.insert(good.end(), good_frame().begin(), good_frame().end());
  const std::vector<Received> received = parsed(parser, good, good.size());
  require(!received.empty() && is_timesync(received.back()), "a good frame behind any bytes is read");
  const ipc::mavlink::Timesync timesync = decode_timesync(received.back());
  require(timesync.tc1_ns == kTimesync.tc1_ns && timesync.ts1_ns == kTimesync.ts1_ns, "it is read rightly");
}

}  // namespace

void run_mavlink(ByteView input) {
  Parser parser, by_bytes;
  const std::vector<Received> received = parsed(&parser, input, input.size());
  const std::vector<Received> same_received = parsed(&by_bytes, input, 1);
  require(std::equal(received.begin(), received.end(), same_received.begin(), same_received.end(), same) &&
              parser.damaged() == by_bytes.damaged(),
          "the pieces in which bytes come change nothing");
  for (const Received& message : received)
    if (is_timesync(message)) check_timesync(message);
  check_recovery(&parser);
}

std::vector<Bytes> seeds_of_mavlink() {
  const ipc::mavlink::Frame odometry = encode(ipc::mavlink::Odometry{}, kSender, 0);
  const ipc::mavlink::Frame heartbeat = encode(ipc::mavlink::Heartbeat{}, kSender, 1);
  Bytes all(odometry.bytes().begin(), odometry.bytes().end());
  all.insert(all.end(), heartbeat.bytes().begin(), heartbeat.bytes().end());
  all.insert(all.end(), good_frame().begin(), good_frame().end());
  // TIMESYNC of version 1: 0xFE, length, sequence, system, component, message; then one of a message that is
  // not taken, and a signed one.
  Bytes old = {0xFE, 16, 3, 1, 2, 111};
  old.resize(old.size() + 16 + 2, 0);
  Bytes others = {0xFD, 4, 0, 0, 0, 1, 1, 30, 0, 0, 9, 9, 9, 9, 0, 0, 0xFD, 1, 1, 0, 0, 1, 1, 111, 0, 0, 7};
  others.resize(others.size() + 2 + 13, 0);
  return {all, Bytes(good_frame().begin(), good_frame().end()), old, others};
}

}  // namespace farpoint::fuzz
