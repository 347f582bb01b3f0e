// drive - the program of the simulated drive. Its firmware is linked in, or loaded from a shared object.
//   armcal-drive[-ROBOT] [--firmware FILE] --scenario FILE --robot FILE --storage FILE [--port N] [--read-port N]
//     [--serial DEVICE] [--truth-log FILE] [--key FILE] [--json FILE]
//   armcal-drive-ROBOT --schema
//     prints which model is linked in
#include <dlfcn.h>

#include <csignal>
#include <cstring>
#include <nlohmann/json.hpp>
#include <optional>

#include "codegen/src/io/atomic_write.hpp"
#include "codegen/src/io/input_error.hpp"
#include "codegen/src/io/json.hpp"
#include "host_sim/client/key_file.hpp"
#include "host_sim/machine/drive/simulated_drive.hpp"

namespace {

using namespace armcal;

std::atomic<bool> quit{false};

// Never unloaded: its objects live until the program ends.
std::unique_ptr<drive::Firmware> Load(const std::string& path, const std::uint8_t* key) {
  auto make = &MakeArmcalFirmware;
  if (!path.empty()) {
    void* library = dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL);
    if (!library) throw io::InputError(std::string(dlerror()));
    make = reinterpret_cast<decltype(make)>(dlsym(library, "MakeArmcalFirmware"));
    if (!make) throw io::InputError(path + ": expected a firmware that armcal has compiled");
  }
  if (!make) throw io::InputError("--firmware: missing, expected a firmware that armcal has compiled");
  std::unique_ptr<drive::Firmware> firmware(make(drive::kFirmwareInterface, key));
  if (!firmware) throw io::InputError(path + ": compiled for another version of armcal; build armcal again");
  return firmware;
}

int Main(int argc, char** argv) {
  drive::DriveOptions o;
  std::string firmware, json;
  std::optional<client::Key> key;
  bool schema = false;
  const auto value = [&](int& i) -> std::string {
    if (i + 1 >= argc) throw io::InputError(std::string(argv[i]) + ": expected a value");
    return argv[++i];
  };
  for (int i = 1; i < argc; ++i) {
    if (!std::strcmp(argv[i], "--scenario")) o.scenario = value(i);
    else if (!std::strcmp(argv[i], "--robot")) o.robot = value(i);
    else if (!std::strcmp(argv[i], "--storage")) o.storage = value(i);
    else if (!std::strcmp(argv[i], "--truth-log")) o.truth_log = value(i);
    else if (!std::strcmp(argv[i], "--port")) o.port = std::stoi(value(i));
    else if (!std::strcmp(argv[i], "--read-port")) o.read_address = o.address, o.read_port = std::stoi(value(i));
    else if (!std::strcmp(argv[i], "--serial")) o.serial = value(i);
    else if (!std::strcmp(argv[i], "--key")) key = client::ReadKey(value(i));
    else if (!std::strcmp(argv[i], "--firmware")) firmware = value(i);
    else if (!std::strcmp(argv[i], "--json")) json = value(i);
    else if (!std::strcmp(argv[i], "--real-time")) o.real_time = true;
    else if (!std::strcmp(argv[i], "--schema")) schema = true;
    else throw io::InputError(std::string(argv[i]) + ": no such option of the simulated drive");
  }
  std::unique_ptr<drive::Firmware> loaded = Load(firmware, key ? key->data() : nullptr);
  if (schema) {
    std::printf("%08X\n", static_cast<unsigned>(loaded->schema()));
    return 0;
  }
  drive::SimulatedDrive drive(o, std::move(loaded));
  drive.Run(quit, [&](const drive::Firmware& f) {
    const std::string read = f.read_port() == 0 ? "" : ", reading alone on port " + std::to_string(f.read_port());
    char schema_text[9];
    std::snprintf(schema_text, sizeof schema_text, "%08X", static_cast<unsigned>(f.schema()));
    const std::string address = o.address + ":" + std::to_string(f.port());
    std::printf("drive: %s, schema %s%s, listening on %s\n", f.name(), schema_text, read.c_str(), address.c_str());
    std::fflush(stdout);
    if (json.empty()) return;
    const nlohmann::ordered_json said{
        {"robot", f.name()}, {"schema", schema_text}, {"address", address}, {"read_port", f.read_port()}};
    io::AtomicWrite(json, io::JsonText(said, 1) + "\n");
  });
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  std::signal(SIGTERM, [](int) { quit = true; });
  std::signal(SIGINT, [](int) { quit = true; });
  std::signal(SIGPIPE, SIG_IGN);
  try {
    return Main(argc, argv);
  } catch (const std::exception& e) {
    std::fprintf(stderr, "armcal drive: %s\n", e.what());
    return 2;
  }
}
