// SPDX-License-Identifier: Apache-2.0
#include "tools/import/bag_topics.h"

#include <algorithm>
#include <map>
#include <utility>

#include "tools/common/errors.h"
#include "tools/import/bag_file.h"
#include "tools/import/images.h"

namespace farpoint::tools {
namespace {

namespace fs = std::filesystem;

bool is_of(const BagTopic& topic, const TopicTypes& types) {
  return std::find(types.begin(), types.end(), topic.type) != types.end();
}

using Key = std::pair<std::string, std::string>;  // name, type

void count_messages(BagFile* bag, std::map<Key, std::uint64_t>* counts) {
  std::map<std::uint32_t, std::uint64_t*> count_of;
  bag->read_all(
      [&](const BagConnection& connection) {
        count_of[connection.id] = &(*counts)[{connection.topic, connection.type}];
      },
      [&](const BagMessage& message) { ++*count_of.at(message.connection); });
}

}  // namespace

BagTopics::BagTopics(const std::vector<fs::path>& files)
    : bag_(files.size() == 1 ? files.front().string() : files.front().parent_path().string()) {
  std::map<Key, std::uint64_t> counts;
  for (const fs::path& file : files) count_messages(open_bag(file).get(), &counts);
  for (const auto& [key, messages] : counts) topics_.push_back({key.first, key.second, messages});
}

void BagTopics::refuse(const std::string& message) const {
  throw InputError(bag_ + ": " + message);
}

std::string BagTopics::names_of(const TopicTypes& types) const {
  std::string names;
  for (const BagTopic& topic : topics_)
    if (is_of(topic, types)) names += (names.empty() ? "" : ", ") + topic.name;
  return names;
}

std::size_t BagTopics::count_of(const TopicTypes& types) const {
  const auto fits = [&](const BagTopic& topic) { return is_of(topic, types); };
  return static_cast<std::size_t>(std::count_if(topics_.begin(), topics_.end(), fits));
}

const BagTopic& BagTopics::require(const std::string& name, const char* option,
                                   const TopicTypes& types) const {
  const BagTopic* found = nullptr;
  std::string other_type;
  for (const BagTopic& topic : topics_) {
    if (!name.empty() && topic.name != name) continue;
    if (!is_of(topic, types)) {
      other_type = topic.type;
      continue;
    }
    if (found != nullptr && name.empty())
      refuse(std::string("several topics, expected ") + option + " with one of " + names_of(types));
    if (found != nullptr)
      refuse(std::string(option) + " " + name + ": has messages of types " + found->type + " and " +
             topic.type + ", expected a topic of one type");
    found = &topic;
  }
  if (found != nullptr) return *found;
  const std::string names = names_of(types);
  if (name.empty())
    refuse(std::string("no topic of type ") + types.front() + ", expected one (--list prints all topics)");
  refuse(std::string(option) + " " + name + ": " +
         (other_type.empty() ? "no such topic" : "of type " + other_type) + ", expected " +
         (names.empty() ? std::string("a topic of type ") + types.front() + ", of which there is none"
                        : "one of " + names));
}

std::vector<fs::path> files_of_bag(const fs::path& path) {
  if (!fs::is_directory(path)) return {path};
  if (!fs::exists(path / "metadata.yaml"))
    throw InputError(path.string() +
                     ": a folder without metadata.yaml, expected a bag or a ROS 2 bag's folder");
  std::vector<fs::path> files;
  for (const fs::directory_entry& entry : fs::directory_iterator(path)) {
    const fs::path extension = entry.path().extension();
    if (extension == ".db3" || extension == ".mcap") files.push_back(entry.path());
  }
  if (files.empty())
    throw InputError(path.string() + ": no .db3 or .mcap file, expected those of a ROS 2 bag, unpacked");
  std::sort(files.begin(), files.end(), [](const fs::path& a, const fs::path& b) {
    return name_less(a.filename().string(), b.filename().string());
  });
  return files;
}

}  // namespace farpoint::tools
