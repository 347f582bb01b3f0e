// bags - decodes the messages of a topic and sorts them by their stamps.
#include "host_sim/data/bags/topic_table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <unordered_set>

#include "codegen/src/io/input_error.hpp"
#include "codegen/src/io/watch.hpp"
#include "host_sim/data/bags/cdr.hpp"
#include "host_sim/data/bags/json_message.hpp"
#include "host_sim/data/bags/unpack.hpp"

namespace armcal::bags {

namespace {

constexpr std::size_t kMostColumnsOfTopic = 4096;
constexpr std::size_t kMostNumbers = std::size_t{1} << 27;
constexpr double kStamped = 0.5;  // of the messages: with fewer stamps in their headers, the recorder's time counts

}  // namespace

TopicTable::TopicTable(const Topic& topic, Definitions known, std::function<bool(const std::string& name)> wanted)
    : topic_(topic), wanted_(std::move(wanted)) {
  const auto fail = [&](const std::string& why) {
    throw io::InputError(fmt::format("topic {} ({}): {}", topic.name, topic.type, why));
  };
  json_ = topic.encoding == "json";
  if (json_) return;
  if (topic.encoding != "cdr")
    fail(fmt::format("its messages are encoded as {}, expected cdr or json", topic.encoding));
  const bool own = topic.schema == "ros2msg" && !topic.definition.empty();
  if (own) known.Add(topic.type, topic.definition);
  else if (!known.Knows(topic.type) && !topic.schema.empty())
    fail(fmt::format("its definition is written in {}, expected ros2msg; give its .msg file with --msg", topic.schema));
  try {
    definition_ = known.Find(topic.type);
  } catch (const io::InputError& error) {
    fail(error.what());
  }
}

void TopicTable::Decode(Bytes message, bool named) {
  if (json_) ReadJson(message, named, flat_);
  else ReadCdr(definition_, message, named, flat_);
}

// Of this recording, all topics together.
void TopicTable::Count(std::size_t more, std::size_t& numbers) {
  numbers += more;
  if (numbers > kMostNumbers)
    throw io::InputError(
        fmt::format("holds more than {} numbers; split the log, or ask for fewer columns", kMostNumbers));
}

// Messages before this one have NaN in it.
std::size_t TopicTable::AddColumn(const std::string& name, std::size_t& numbers) {
  Count(recorded_ns_.size(), numbers);
  if (names_.size() == kMostColumnsOfTopic)
    throw io::InputError(fmt::format("it has more than {} columns", kMostColumnsOfTopic));
  names_.push_back(name);
  values_.emplace_back(recorded_ns_.size(), NAN);
  return names_.size() - 1;
}

// The columns of the values in flat_. Messages of one shape share them.
const std::vector<int>& TopicTable::Places(Bytes message, std::size_t& numbers) {
  if (!column_.empty() && flat_.shape == last_shape_) return last_place_;
  Decode(message, true);
  last_shape_ = flat_.shape;
  last_place_.clear();
  std::unordered_set<std::string_view> seen;
  for (const std::string& path : flat_.name) {
    if (!seen.insert(path).second) throw io::InputError(fmt::format("a message has '{}' twice", path));
    const std::string name = topic_.name + path;
    auto [at, fresh] = column_.try_emplace(name, -1);
    if (fresh && column_.size() > kMostColumnsOfTopic)
      throw io::InputError(fmt::format("it has more than {} columns", kMostColumnsOfTopic));
    if (fresh && wanted_(name)) at->second = static_cast<int>(AddColumn(name, numbers));
    else if (fresh) ignored_.push_back(name);
    last_place_.push_back(at->second);
  }
  return last_place_;
}

void TopicTable::Add(const Message& message, std::size_t& numbers) {
  io::CancellationPoint();
  try {
    Bytes data = message.data;
    if (!json_ && IsZstd(data)) {  // rosbag2 can compress each message
      unpacked_ = UnpackZstd(data);
      data = unpacked_;
    }
    Decode(data, false);
    const std::vector<int>& place = Places(data, numbers);
    for (std::vector<double>& column : values_) column.push_back(NAN);
    for (std::size_t k = 0; k < place.size(); ++k)
      if (place[k] >= 0) values_[static_cast<std::size_t>(place[k])].back() = flat_.value[k];
    recorded_ns_.push_back(message.recorded_ns);
    header_ns_.push_back(flat_.stamp_ns);
  } catch (const io::InputError& error) {
    throw io::InputError(fmt::format("topic {}, message {}: {}", topic_.name, recorded_ns_.size() + 1, error.what()));
  }
  Count(values_.size(), numbers);
}

// Some programs leave the stamp out, or never change it.
bool TopicTable::StampsServe() const {
  std::size_t fresh = 0;
  for (std::size_t k = 0; k < header_ns_.size(); ++k)
    fresh += header_ns_[k] != 0 && (k == 0 || header_ns_[k] != header_ns_[k - 1]);
  return static_cast<double>(fresh) >= kStamped * static_cast<double>(header_ns_.size());
}

Stream TopicTable::Finish(bool recorder_time) {
  Stream out{topic_.name, topic_.type, recorder_time || !StampsServe(), {}, std::move(names_), {}};
  const std::vector<std::int64_t>& stamp = out.recorder_time ? recorded_ns_ : header_ns_;
  std::vector<std::size_t> order;
  for (std::size_t k = 0; k < stamp.size(); ++k) {
    if (!out.recorder_time && stamp[k] == 0) {
      ++out.unstamped;
      continue;
    }
    out.backward += !order.empty() && stamp[k] < stamp[order.back()];
    order.push_back(k);
  }
  std::stable_sort(order.begin(), order.end(), [&stamp](std::size_t a, std::size_t b) { return stamp[a] < stamp[b]; });
  const auto rows = static_cast<Eigen::Index>(order.size());
  out.values.resize(rows, static_cast<Eigen::Index>(values_.size()));
  for (std::size_t c = 0; c < values_.size(); ++c) {
    for (Eigen::Index k = 0; k < rows; ++k)
      out.values(k, static_cast<Eigen::Index>(c)) = values_[c][order[static_cast<std::size_t>(k)]];
    values_[c] = {};
  }
  for (const std::size_t k : order) out.stamp_ns.push_back(stamp[k]);
  return out;
}

}  // namespace armcal::bags
