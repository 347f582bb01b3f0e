// bags - collects the numbers of a topic's messages as columns.
#pragma once

#include <functional>
#include <unordered_map>

#include "host_sim/data/bags/container.hpp"
#include "host_sim/data/bags/definition.hpp"
#include "host_sim/data/bags/flat.hpp"
#include "host_sim/data/bags/recording.hpp"

namespace armcal::bags {

class TopicTable {
 public:
  // InputError, without a file name: the topic's encoding or definition is none that armcal reads.
  TopicTable(const Topic& topic, Definitions known, std::function<bool(const std::string& name)> wanted);

  // `numbers` is the count of all tables together, which must stay bounded.
  void Add(const Message& message, std::size_t& numbers);

  // All rows in the order of their stamps. Messages without a stamp are left out if most of the others have one.
  Stream Finish(bool recorder_time);

  const std::string& type() const { return topic_.type; }
  const std::vector<std::string>& ignored() const { return ignored_; }

 private:
  void Decode(Bytes message, bool named);
  const std::vector<int>& Places(Bytes message, std::size_t& numbers);
  std::size_t AddColumn(const std::string& name, std::size_t& numbers);
  static void Count(std::size_t more, std::size_t& numbers);
  bool StampsServe() const;

  Topic topic_;
  Definition definition_;  // of CDR
  bool json_ = false;
  std::function<bool(const std::string&)> wanted_;
  std::string unpacked_;
  Flat flat_;
  std::string last_shape_;
  std::vector<int> last_place_;                  // of each value the column, -1: not wanted
  std::unordered_map<std::string, int> column_;  // by name; -1: not wanted
  std::vector<std::string> names_, ignored_;
  std::vector<std::vector<double>> values_;            // [column][message]
  std::vector<std::int64_t> recorded_ns_, header_ns_;  // [message]
};

}  // namespace armcal::bags
