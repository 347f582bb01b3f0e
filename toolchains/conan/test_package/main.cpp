// conan - a program that calls a compiled function of the library and includes a model.
#include <armcal/armcal.hpp>
#include <model.hpp>

int main() {
  // "read holding register 0 of device 1"; 84 0A is the known checksum of this request.
  const unsigned char request[] = {0x01, 0x03, 0x00, 0x00, 0x00, 0x01, 0x84, 0x0A};
  armcal::link::RtuFramer framer(1, 2);
  std::size_t used = 0;
  const bool whole = framer.OnBytes(request, sizeof request, 0, used) == armcal::link::RtuFramer::Result::kRequest;
  return whole && armcal::generated::Er20Like::kJoints == 6 ? 0 : 1;
}
