// client - the file that keeps a drive's table: writes it as JSON, and reads it back.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

namespace armcal::client {

// A checksum or a schema as eight hexadecimal digits.
std::string CrcText(std::uint32_t crc);

// {"armcal_backup": 1, "schema", "serial_number", "table_crc", "words"}: a table and the drive that it comes from.
nlohmann::ordered_json BackupJson(std::span<const std::uint16_t> words, std::uint32_t schema,
                                  std::uint32_t serial_number);

struct TableBackup {
  std::vector<std::uint16_t> words;
  std::optional<std::uint32_t> serial_number;  // of the drive that it comes from, if the file tells it
};

// Throws io::InputError: it is another file, or its words differ from its checksum or its schema.
TableBackup ReadBackup(const std::string& path);

}  // namespace armcal::client
