// SPDX-License-Identifier: Apache-2.0
// usage: fuzz_seeds FOLDER     Writes the seeds of every target to FOLDER/TARGET, and prints 'TARGET
// MAX_BYTES'.
#include <cstdio>
#include <filesystem>
#include <fstream>

#include "tests/fuzz/targets.h"

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "fuzz_seeds: expected one folder\n");
    return 2;
  }
  for (const farpoint::fuzz::Target& target : farpoint::fuzz::targets()) {
    const std::filesystem::path folder = std::filesystem::path(argv[1]) / target.name;
    std::filesystem::create_directories(folder);
    int number = 0;
    for (const farpoint::fuzz::Bytes& seed : target.seeds()) {
      std::ofstream file(folder / ("seed_" + std::to_string(number++)), std::ios::binary);
      file.write(reinterpret_cast<const char*>(seed.data()), static_cast<std::streamsize>(seed.size()));
    }
    std::printf("%s %d\n", target.name.c_str(), target.max_bytes);
  }
}
