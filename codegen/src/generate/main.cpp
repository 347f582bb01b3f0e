// generate - the program armcal-generate.
#include <cstdio>

#include "codegen/src/generate/generate.hpp"

// Exit codes as those of the armcal tool: 0 ok, 2 usage or bad input.
int main(int argc, char** argv) {
  CLI::App app(std::string("armcal-generate: ") + armcal::codegen::kGenerateHelp);
  armcal::codegen::GenerateOptions options;
  armcal::codegen::AddGenerateOptions(app, options);
  try {
    app.parse(argc, argv);
    armcal::codegen::Generate(options);
    return 0;
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? 0 : 2;
  } catch (const std::exception& e) {
    std::fprintf(stderr, "armcal-generate: %s\n", e.what());
    return 2;
  }
}
