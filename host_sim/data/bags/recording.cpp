// bags - finds the files of a recording and reads the topics that are asked for.
#include "host_sim/data/bags/recording.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <map>
#include <optional>
#include <set>

#include "codegen/src/io/input_error.hpp"
#include "host_sim/data/bags/bag_folder.hpp"
#include "host_sim/data/bags/container.hpp"
#include "host_sim/data/bags/mapped_file.hpp"
#include "host_sim/data/bags/one_line.hpp"
#include "host_sim/data/bags/topic_table.hpp"
#include "host_sim/data/bags/unpack.hpp"
#include "host_sim/data/files/files.hpp"

namespace armcal::bags {

namespace {

namespace fs = std::filesystem;

// "pkg/msg/Name.msg" defines pkg/Name; a file elsewhere defines Name of any package.
std::string DefinedBy(const fs::path& path) {
  const fs::path folder = path.parent_path();
  const std::string stem = path.stem().string();
  return folder.filename() == "msg" && folder.has_parent_path() ? folder.parent_path().filename().string() + "/" + stem
                                                                : stem;
}

class Collector {
 public:
  explicit Collector(const Asked& asked) : asked_(asked), wanted_(asked.columns.begin(), asked.columns.end()) {
    for (const fs::path& path : asked.definitions) known_.Add(DefinedBy(path), files::ReadWholeFile(path));
    taker_.wants = [this](const Topic& topic) { return Wants(topic); };
    taker_.take = [this](const Topic& topic, const Message& message) { table_.at(topic.name)->Add(message, numbers_); };
    taker_.note = [this](const std::string& note) { out_.notes.push_back(note); };
  }

  void Read(const fs::path& path) {
    const MappedFile file(path);
    const std::size_t notes = out_.notes.size();
    try {
      if (!IsZstd(file.bytes())) ReadContent(path.string(), file.bytes());
      else ReadContent("", UnpackZstd(file.bytes()));
    } catch (const io::InputError& error) {
      throw io::InputError(path.string() + ": " + OneLine(error.what()));
    }
    for (std::size_t k = notes; k < out_.notes.size(); ++k) out_.notes[k] = OneLine(out_.notes[k]);
  }

  Recording Finish() {
    for (const auto& [name, type] : type_) out_.topics.push_back(OneLine(fmt::format("{} ({})", name, type)));
    for (auto& [name, table] : table_) {
      if (!table) continue;
      out_.ignored.insert(out_.ignored.end(), table->ignored().begin(), table->ignored().end());
      Stream stream = table->Finish(asked_.recorder_time);
      if (!stream.names.empty() && !stream.stamp_ns.empty()) out_.streams.push_back(std::move(stream));
    }
    for (const Stream& stream : out_.streams) NoteTime(stream);
    return std::move(out_);
  }

 private:
  void NoteTime(const Stream& stream) {
    const auto note = [&](const std::string& text) { out_.notes.push_back(OneLine(stream.topic + ": " + text)); };
    note(!stream.recorder_time  ? "time is header.stamp"
         : asked_.recorder_time ? "time is the recorder's, as asked for"
                                : "time is the recorder's, for most messages have no header.stamp of their own");
    const std::size_t read = stream.stamp_ns.size() + stream.unstamped;
    if (stream.unstamped > 0)
      note(fmt::format("{} of {} messages have no header.stamp and are left out; the recorder's time keeps them",
                       stream.unstamped, read));
    if (stream.backward > 0)
      note(
          fmt::format("{} of {} messages have a time before that of the message in front of them; all are put in order",
                      stream.backward, read));
  }

  void ReadContent(const std::string& path, Bytes content) {
    if (IsMcap(content)) ReadMcap(content, taker_);
    else if (IsDatabase(content)) ReadDatabase(path, content, taker_);
    else throw io::InputError("expected MCAP or a database of rosbag2");
  }

  bool WantsColumnsOf(const std::string& topic) const {
    if (asked_.columns.empty()) return true;
    const auto at = wanted_.lower_bound(topic + "/");
    return at != wanted_.end() && at->starts_with(topic + "/");
  }

  bool Wants(const Topic& topic) {
    const auto [known, fresh] = type_.try_emplace(topic.name, topic.type);
    if (!WantsColumnsOf(topic.name)) return false;
    if (!fresh && known->second != topic.type)
      throw io::InputError(fmt::format("topic {} has two types, {} and {}", topic.name, known->second, topic.type));
    if (!fresh && table_.contains(topic.name)) return table_[topic.name] != nullptr;
    try {
      table_[topic.name] = std::make_unique<TopicTable>(
          topic, known_, [this](const std::string& name) { return asked_.columns.empty() || wanted_.contains(name); });
    } catch (const io::InputError& error) {
      if (!asked_.columns.empty()) throw;
      out_.notes.push_back(error.what());
      table_[topic.name] = nullptr;
    }
    return table_[topic.name] != nullptr;
  }

  const Asked& asked_;
  std::set<std::string> wanted_;
  Definitions known_;
  Taker taker_;
  Recording out_;
  std::map<std::string, std::string> type_;
  std::map<std::string, std::unique_ptr<TopicTable>> table_;  // nullptr: cannot be read
  std::size_t numbers_ = 0;
};

}  // namespace

bool IsRecording(const fs::path& path) {
  std::error_code error;
  if (fs::is_directory(path, error)) return true;
  char head[32] = {};
  std::ifstream in(path, std::ios::binary);
  in.read(head, sizeof head);
  const Bytes bytes(head, static_cast<std::size_t>(in.gcount()));
  return IsMcap(bytes) || IsDatabase(bytes) || IsZstd(bytes);
}

Recording ReadRecording(const fs::path& path, const Asked& asked) {
  Collector collector(asked);
  for (const fs::path& file : FilesOfRecording(path)) collector.Read(file);
  return collector.Finish();
}

}  // namespace armcal::bags
