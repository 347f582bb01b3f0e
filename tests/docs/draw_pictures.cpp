// tests - writes the pictures of docs into a folder: draw_pictures FOLDER, in the top folder.
#include <filesystem>
#include <fstream>
#include <iostream>

#include "tests/docs/pictures.hpp"

int main(int count, char** words) {
  if (count != 2) return std::cerr << "usage: draw_pictures FOLDER\n", 2;
  try {
    armcal::tests::Pictures pictures = armcal::tests::EffectPictures();
    pictures.merge(armcal::tests::ConceptPictures());
    for (const auto& [name, text] : pictures) {
      const std::filesystem::path path = std::filesystem::path(words[1]) / name;
      std::filesystem::create_directories(path.parent_path());
      if (!(std::ofstream(path) << text)) throw std::runtime_error(path.string() + ": cannot be written");
    }
    std::cout << pictures.size() << " pictures\n";
  } catch (const std::exception& e) {
    return std::cerr << e.what() << "\n", 1;
  }
}
