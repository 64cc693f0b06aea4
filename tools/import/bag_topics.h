// SPDX-License-Identifier: Apache-2.0
// Topics of a bag, and which of them an import takes.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace farpoint::tools {

// A name with messages of two types is two topics.
struct BagTopic {
  std::string name, type;  // the type without "/msg": "sensor_msgs/Image"
  std::uint64_t messages = 0;
};

using TopicTypes = std::vector<const char*>;

class BagTopics {
 public:
  // Reads all of the files of one recording. Throws InputError naming the place of damage.
  explicit BagTopics(const std::vector<std::filesystem::path>& files);

  // In the order of their names.
  [[nodiscard]] const std::vector<BagTopic>& all() const { return topics_; }
  // The topic of that name and one of the types, or the only one of the types where the name is empty. Throws
  // InputError naming `option` and the topics that fit.
  [[nodiscard]] const BagTopic& require(const std::string& name, const char* option,
                                        const TopicTypes& types) const;
  // Names of the topics of these types, with commas between; empty: none.
  [[nodiscard]] std::string names_of(const TopicTypes& types) const;
  [[nodiscard]] std::size_t count_of(const TopicTypes& types) const;

 private:
  [[noreturn]] void refuse(const std::string& message) const;

  std::string bag_;  // for errors
  std::vector<BagTopic> topics_;
};

// The files of a recording: `path`, or those of a folder of ROS 2 (metadata.yaml beside .db3 or .mcap files)
// in the order of their names. Throws InputError.
[[nodiscard]] std::vector<std::filesystem::path> files_of_bag(const std::filesystem::path& path);

}  // namespace farpoint::tools
