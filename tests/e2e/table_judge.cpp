// end-to-end tests - the firmware's check of tables, compiled for one generated model by accepted_tables_test.cpp.
//   table_judge < WORDS    WORDS: a table a line, its words in hex. The first answer is about the model's default
//   table.
// An answer is a line: "accepted", or the status, word, value and bound of the refusal.
#include <cstdint>
#include <iostream>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include "armcal/controller/table_check.hpp"
#include "selected_model.hpp"

namespace {

using namespace armcal;
using Model = generated::SelectedModel;

void Judge(const std::vector<std::uint16_t>& words) {
  const auto check = std::make_unique<controller::TableCheck<Model>>();
  const auto spare = std::make_unique<estimator::AdoptedTable<Model>>();
  check->Begin(
      words.data(), static_cast<int>(words.size()), model::View(Model::kCeilings), false, false, 1,
      [](const estimator::AdoptedTable<Model>&) { return true; }, *spare);
  core::Refusal refusal;
  do refusal = check->Step();
  while (refusal.status == core::Status::kBusy);
  if (core::IsOk(refusal.status)) std::cout << "accepted\n";
  else
    std::cout << "status " << static_cast<int>(refusal.status) << ", word " << refusal.word << ": " << refusal.value
              << ", bound " << refusal.bound << "\n";
}

}  // namespace

int main() {
  std::vector<std::uint16_t> words(estimator::Table<Model>::kWords);
  model::Encode(estimator::DefaultTable<Model>(), words.data());
  Judge(words);
  for (std::string line; std::getline(std::cin, line);) {
    std::istringstream in(line);
    words.clear();
    for (unsigned word = 0; in >> std::hex >> word;) words.push_back(static_cast<std::uint16_t>(word));
    Judge(words);
  }
  return 0;
}
