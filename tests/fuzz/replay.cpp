// SPDX-License-Identifier: Apache-2.0
// Replaces libFuzzer where it is not available: runs a target on every file of a folder, and on
// mutations of each file that are the same in every run.
//
// usage: fuzz_NAME FOLDER. Exits with 1 if the folder has no file. The target aborts if it finds an
// error.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <string>
#include <vector>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace {

using Input = std::vector<std::uint8_t>;

constexpr unsigned kMutations = 200;

std::vector<std::filesystem::path> files_in(const char* folder) {
  std::vector<std::filesystem::path> files;
  std::error_code error;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder, error)) {
    if (entry.is_regular_file()) {
      files.push_back(entry.path());
    }
  }
  std::sort(files.begin(), files.end());
  return files;
}

Input read(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

void run(const Input& input) {
  LLVMFuzzerTestOneInput(input.data(), input.size());
}

std::size_t position(const Input& input, std::mt19937& random) {
  return input.empty() ? 0 : random() % input.size();
}

// One small change: replaces a byte, truncates, or repeats or removes a part.
void mutate(Input& input, std::mt19937& random) {
  const std::size_t a = position(input, random);
  const std::size_t b = std::min(input.size(), a + random() % 64);
  const auto at = [&](std::size_t i) { return input.begin() + static_cast<std::ptrdiff_t>(i); };
  switch (random() % 4) {
    case 0:
      if (!input.empty()) {
        input[a] = static_cast<std::uint8_t>(random());
      }
      break;
    case 1:
      input.resize(a);
      break;
    case 2: {
      const Input part(at(a), at(b));
      input.insert(at(position(input, random)), part.begin(), part.end());
      break;
    }
    default:
      input.erase(at(a), at(b));
      break;
  }
}

}  // namespace

int main(int argc, char** argv) {
  const auto files = argc == 2 ? files_in(argv[1]) : std::vector<std::filesystem::path>{};
  if (files.empty()) {
    std::fprintf(stderr, "usage: %s FOLDER (with at least one file)\n", argv[0]);
    return 1;
  }
  std::mt19937 random(1);
  for (const auto& path : files) {
    std::printf("%s\n", path.filename().c_str());
    std::fflush(stdout);
    const Input input = read(path);
    run(input);
    for (unsigned i = 0; i < kMutations; ++i) {
      Input mutated = input;
      for (unsigned changes = 1 + random() % 4; changes != 0; --changes) {
        mutate(mutated, random);
      }
      run(mutated);
    }
  }
  return 0;
}
