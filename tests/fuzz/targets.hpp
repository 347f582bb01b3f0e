// fuzz - what arbitrary bytes are given to. Each target ends the program if something that must never happen does.
#pragma once

#include <cstddef>
#include <cstdint>

namespace armcal::fuzz {

struct Target {
  const char* name;  // also of its folder in tests/fuzz/corpus
  void (*run)(const std::uint8_t* bytes, std::size_t count);
};

// The bytes that come over a line, and the words of a table.
void Rtu(const std::uint8_t* bytes, std::size_t count);
void Tcp(const std::uint8_t* bytes, std::size_t count);
// Requests of three connections, and whole steps of flashing: the table in force is the one before or one that was
// checked.
void Engine(const std::uint8_t* bytes, std::size_t count);
// The same requests, trials and ticks, given to the whole controller of a small arm: no torque is beyond its ceiling.
void Controller(const std::uint8_t* bytes, std::size_t count);
void Table(const std::uint8_t* bytes, std::size_t count);
void Vendor(const std::uint8_t* bytes, std::size_t count);
// Files. Bad ones are io::InputError, nothing else.
void Csv(const std::uint8_t* bytes, std::size_t count);
void Gzip(const std::uint8_t* bytes, std::size_t count);
void Robot(const std::uint8_t* bytes, std::size_t count);
void Mcap(const std::uint8_t* bytes, std::size_t count);
// A verdict, and a backup of a table.
void Json(const std::uint8_t* bytes, std::size_t count);

inline constexpr Target kTargets[] = {
    {"rtu", Rtu},     {"tcp", Tcp},       {"engine", Engine}, {"controller", Controller},
    {"table", Table}, {"vendor", Vendor}, {"csv", Csv},       {"gzip", Gzip},
    {"robot", Robot}, {"mcap", Mcap},     {"json", Json}};

}  // namespace armcal::fuzz
