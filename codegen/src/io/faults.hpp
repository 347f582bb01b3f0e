// io - collects the faults of a file, so that a person reads all of them after one run.
#pragma once

#include <algorithm>
#include <string>
#include <string_view>
#include <vector>

#include "codegen/src/io/input_error.hpp"

namespace armcal::io {

class Faults {
 public:
  // One line; the same line counts once.
  void Add(const std::string& line) {
    if (std::find(line_.begin(), line_.end(), line) == line_.end()) line_.push_back(line);
  }
  // Runs what may throw an InputError, and keeps its lines. False: it threw.
  template <class Work>
  bool Try(Work&& work) {
    try {
      work();
      return true;
    } catch (const InputError& e) {
      const std::string text = e.what();
      for (std::size_t begin = 0; begin <= text.size();) {
        const std::size_t end = std::min(text.find('\n', begin), text.size());
        Add(text.substr(begin, end - begin));
        begin = end + 1;
      }
      return false;
    }
  }
  // InputError of all lines, if there are any.
  void ThrowIfAny() const {
    std::string text;
    for (const std::string& line : line_) text += (text.empty() ? "" : "\n") + line;
    if (!line_.empty()) throw InputError(text);
  }
  bool empty() const { return line_.empty(); }
  const std::vector<std::string>& lines() const { return line_; }

 private:
  std::vector<std::string> line_;
};

// The word of `known` that takes the fewest edits to write, or one that begins with `word`; empty if there is neither.
template <class Words>
std::string Nearest(std::string_view word, const Words& known) {
  const auto distance = [&word](std::string_view other) {
    std::vector<std::size_t> row(other.size() + 1);
    for (std::size_t k = 0; k <= other.size(); ++k) row[k] = k;
    for (std::size_t i = 1; i <= word.size(); ++i) {
      std::size_t diagonal = row[0];
      row[0] = i;
      for (std::size_t k = 1; k <= other.size(); ++k) {
        const std::size_t above = row[k];
        row[k] = std::min({above + 1, row[k - 1] + 1, diagonal + (word[i - 1] == other[k - 1] ? 0 : 1)});
        diagonal = above;
      }
    }
    return row.back();
  };
  std::string best;
  std::size_t fewest = std::max<std::size_t>(2, word.size() / 3) + 1;
  for (const auto& other : known)
    if (const std::size_t edits = distance(other); edits < fewest) fewest = edits, best = std::string(other);
  constexpr std::size_t kFewestLetters = 4;
  if (best.empty() && word.size() >= kFewestLetters)
    for (const auto& other : known)
      if (std::string_view(other).starts_with(word)) return std::string(other);
  return best;
}

}  // namespace armcal::io
