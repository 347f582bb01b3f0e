// drive - the simulated drive's process: options, signals, one line with the port; the model is chosen when it is
// compiled.
#include <csignal>
#include <cstring>

#include <selected_model.hpp>
#include "host_sim/machine/drive/drive.hpp"

namespace {

std::atomic<bool> quit{false};

int Main(int argc, char** argv) {
  armcal::drive::DriveOptions o;
  const auto value = [&](int& i) -> std::string {
    if (i + 1 >= argc) throw armcal::io::InputError(std::string(argv[i]) + ": expected a value");
    return argv[++i];
  };
  for (int i = 1; i < argc; ++i) {
    if (!std::strcmp(argv[i], "--scenario")) o.scenario = value(i);
    else if (!std::strcmp(argv[i], "--robot")) o.robot = value(i);
    else if (!std::strcmp(argv[i], "--storage")) o.storage = value(i);
    else if (!std::strcmp(argv[i], "--truth-log")) o.truth_log = value(i);
    else if (!std::strcmp(argv[i], "--port")) o.port = std::stoi(value(i));
    else if (!std::strcmp(argv[i], "--real-time")) o.real_time = true;
    else throw armcal::io::InputError(std::string(argv[i]) + ": no such option of the simulated drive");
  }
  const auto drive = std::make_unique<armcal::drive::Drive<armcal::generated::SelectedModel>>(o);
  drive->Run(quit, [&](int port) {
    std::printf("drive: %s, schema %08X, listening on %s:%d\n", armcal::generated::SelectedModel::kName,
                static_cast<unsigned>(armcal::generated::SelectedModel::kSchema), o.address.c_str(), port);
    std::fflush(stdout);
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
