// client - the file that keeps a drive's table: writes it as JSON, and reads it back.
#include "host_sim/client/table_backup.hpp"

#include <fmt/core.h>

#include "armcal/core/crc.hpp"
#include "armcal/core/words.hpp"
#include "codegen/src/io/input_error.hpp"
#include "host_sim/data/files/files.hpp"

namespace armcal::client {

using nlohmann::ordered_json;

namespace {

std::string ChecksumOf(std::span<const std::uint16_t> words) {
  return CrcText(core::Crc32Words(words.data(), words.size()));
}

}  // namespace

std::string CrcText(std::uint32_t crc) { return fmt::format("{:08X}", crc); }

ordered_json BackupJson(std::span<const std::uint16_t> words, std::uint32_t schema, std::uint32_t serial_number) {
  return {{"armcal_backup", 1},
          {"schema", CrcText(schema)},
          {"serial_number", serial_number},
          {"table_crc", ChecksumOf(words)},
          {"words", std::vector<std::uint16_t>(words.begin(), words.end())}};
}

TableBackup ReadBackup(const std::string& path) {
  const auto json = files::ReadJsonFile(path);
  const auto bad = [&](const char* what) {
    return io::InputError(path + ": expected a file of armcal backup: " + what);
  };
  if (!json.is_object() || json.value("armcal_backup", ordered_json()) != 1 || !json.contains("words"))
    throw bad("with \"armcal_backup\": 1 and \"words\"");
  TableBackup out;
  std::vector<std::uint16_t>& words = out.words;
  if (!json.at("words").is_array()) throw bad("\"words\" is no list");
  for (const auto& w : json.at("words")) {
    if (!w.is_number_unsigned() || w.get<std::uint64_t>() > 0xFFFF) throw bad("a word is no number from 0 to 65535");
    words.push_back(w.get<std::uint16_t>());
  }
  if (json.value("table_crc", ordered_json()) != ChecksumOf(words)) throw bad("words and \"table_crc\" differ");
  if (json.contains("schema") && (words.size() < 2 || json["schema"] != CrcText(core::GetU32(words.data()))))
    throw bad("words and \"schema\" differ");
  if (json.contains("serial_number")) {
    const ordered_json& number = json["serial_number"];
    if (!number.is_number_unsigned() || number.get<std::uint64_t>() > 0xFFFFFFFF)
      throw bad("\"serial_number\" is no 32-bit number");
    out.serial_number = number.get<std::uint32_t>();
  }
  return out;
}

}  // namespace armcal::client
