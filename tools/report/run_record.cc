// SPDX-License-Identifier: Apache-2.0
#include "tools/report/run_record.h"

#include "ipc/channels.h"
#include "ipc/log.h"
#include "tools/common/errors.h"

namespace farpoint::tools::report {
namespace {

void add_pose(const ipc::LogEvent& event, RunRecord* record) {
  pose_t m;
  if (!ipc::decode(event.data, &m)) return;
  record->frames.push_back({seconds_of(m.utime), m.state, m.valid != 0, m.features, m.matches, m.inliers});
}

template <typename Message>
void add(const ipc::LogEvent& event, std::vector<Message>* messages) {
  Message m;
  if (ipc::decode(event.data, &m)) messages->push_back(std::move(m));
}

void read_messages(const std::filesystem::path& file, RunRecord* record) {
  ipc::LogReader reader(file.string());
  ipc::LogEvent event;
  while (reader.next(&event)) {
    if (event.channel == ipc::kPoseChannel) add_pose(event, record);
    if (event.channel == ipc::kTimingChannel) add(event, &record->timings);
    if (event.channel == ipc::kStatusChannel) add(event, &record->statuses);
    if (event.channel == ipc::kMapChannel) {
      map_t map;
      if (ipc::decode(event.data, &map)) record->map = std::move(map);
    }
  }
}

}  // namespace

const landmarks_t* RunRecord::landmarks() const {
  return run.log && run.log->landmarks ? &*run.log->landmarks : nullptr;
}

const summary_t* RunRecord::summary() const {
  return run.log && run.log->summary ? &*run.log->summary : nullptr;
}

slam::Sim3 RunRecord::world_from_map() const {
  if (!metrics || !metrics->final_metrics.absolute) return {};
  return metrics->final_metrics.absolute->map_to_world.S_world_map;
}

double RunRecord::scale() const {
  return world_from_map().scale;
}

std::string RunRecord::length_unit() const {
  const bool metric = run.log && run.log->scale_state != status_t::SCALE_UNKNOWN;
  return (metrics && metrics->final_metrics.absolute) || metric ? "m" : "map units";
}

RunRecord read_run_record(const std::filesystem::path& file, const Truth* truth) {
  if (!is_lcm_log(file))
    throw InputError(file.string() + ": expected an output log of farpointd (--output), not a text file");
  RunRecord record;
  record.run = read_run(file);
  record.name = record.run.name;
  if (truth != nullptr) record.metrics = evaluate_run(record.run, *truth, {});
  read_messages(file, &record);
  if (!record.frames.empty()) record.start_s = record.frames.front().time_s;
  return record;
}

}  // namespace farpoint::tools::report
