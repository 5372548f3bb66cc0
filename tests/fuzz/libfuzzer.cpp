// The program that libFuzzer drives. SOFTARM_FUZZ_TARGET names the target; with --list it names
// them all with their executions, with --prepare FOLDER it writes what each begins with.
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "fuzz/target.hpp"

namespace {

using softarm::test::FuzzTarget;

const FuzzTarget* chosen = nullptr;

/// FOLDER/TARGET/seeds/0, 1, ... and FOLDER/TARGET/words, as libFuzzer reads dictionaries.
void prepare(const std::filesystem::path& folder) {
  for (const FuzzTarget& target : softarm::test::fuzz_targets()) {
    std::filesystem::create_directories(folder / target.name / "seeds");
    int number = 0;
    for (const auto& seed : target.seeds())
      std::ofstream(folder / target.name / "seeds" / std::to_string(number++), std::ios::binary)
          .write(reinterpret_cast<const char*>(seed.data()),
                 static_cast<std::streamsize>(seed.size()));
    std::ofstream words(folder / target.name / "words");
    for (const std::string& word : target.words()) {
      words << '"';
      for (const char c : word) {
        char escaped[5];
        std::snprintf(escaped, sizeof escaped, "\\x%02X", static_cast<unsigned char>(c));
        words << escaped;
      }
      words << "\"\n";
    }
  }
}

}  // namespace

extern "C" int LLVMFuzzerInitialize(int* argc, char*** argv) {
  if (*argc == 2 && std::strcmp((*argv)[1], "--list") == 0) {
    for (const FuzzTarget& target : softarm::test::fuzz_targets())
      std::printf("%s %ld %zu\n", target.name.c_str(), target.executions, target.largest);
    std::exit(0);
  }
  if (*argc == 3 && std::strcmp((*argv)[1], "--prepare") == 0) {
    prepare((*argv)[2]);
    std::exit(0);
  }
  const char* wanted = std::getenv("SOFTARM_FUZZ_TARGET");
  for (const FuzzTarget& target : softarm::test::fuzz_targets())
    if (wanted != nullptr && target.name == wanted) chosen = &target;
  if (chosen == nullptr) {
    std::fprintf(stderr, "set SOFTARM_FUZZ_TARGET to a target; --list names them\n");
    std::exit(64);
  }
  return 0;
}

/// A broken property ends the program as an uncaught exception, which libFuzzer reports.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  chosen->run(std::as_bytes(std::span(data, size)));
  return 0;
}
