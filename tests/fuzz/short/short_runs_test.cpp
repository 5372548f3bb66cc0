// Every fuzzing target without libFuzzer and clang: what it begins with, what once broke it, and
// some thousand mutations, the same in every run.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iomanip>
#include <random>
#include <sstream>

#include "fuzz/target.hpp"
#include "test_folder.hpp"

namespace softarm::test {
namespace {

namespace fs = std::filesystem;

/// tests/fuzz/corpus/TARGET: inputs that found something.
std::vector<Bytes> committed(const std::string& target) {
  std::vector<Bytes> inputs;
  const fs::path folder = fs::path(SOFTARM_SOURCE_DIR) / "tests/fuzz/corpus" / target;
  if (!fs::exists(folder)) return inputs;
  for (const auto& entry : fs::directory_iterator(folder))
    inputs.push_back(to_bytes(file_text(entry.path())));
  return inputs;
}

class Mutator {
 public:
  Mutator(std::vector<Bytes> inputs, const FuzzTarget& target)
      : inputs_(std::move(inputs)), words_(target.words()), largest_(target.largest) {}

  Bytes next() {
    Bytes mutant = pick(inputs_);
    for (std::size_t edits = 1 + below(5); edits > 0; --edits) edit(mutant);
    mutant.resize(std::min(mutant.size(), largest_));
    return {mutant.begin(), mutant.end()};  // its capacity is its size: a sanitizer sees its end
  }

 private:
  std::size_t below(std::size_t end) {
    return std::uniform_int_distribution<std::size_t>(0, end - 1)(random_);
  }
  template <class List>
  const typename List::value_type& pick(const List& list) {
    return list[below(list.size())];
  }
  static auto at(Bytes& bytes, std::size_t index) {
    return bytes.begin() + static_cast<std::ptrdiff_t>(index);
  }

  void edit(Bytes& mutant) {
    const std::size_t place = below(mutant.size() + 1);
    const std::size_t length = std::min(mutant.size() - place, 1 + below(16));
    switch (below(7)) {
      case 0:
        if (length > 0) mutant[place] = static_cast<std::byte>(random_());
        break;
      case 1:
        if (length > 0) mutant[place] ^= static_cast<std::byte>(1u << below(8));
        break;
      case 2:
        mutant.erase(at(mutant, place), at(mutant, place + length));
        break;
      case 3: {  // something from elsewhere
        const Bytes& other = pick(inputs_);
        const std::size_t from = below(other.size() + 1);
        const std::size_t to = std::min(other.size(), from + below(64));
        const Bytes part(other.begin() + static_cast<std::ptrdiff_t>(from),
                         other.begin() + static_cast<std::ptrdiff_t>(to));
        mutant.insert(at(mutant, place), part.begin(), part.end());
        break;
      }
      case 4:
      case 5: {  // a word, over what is there or between it
        const Bytes word = to_bytes(pick(words_));
        if (below(2) == 0 && place + word.size() <= mutant.size())
          std::copy(word.begin(), word.end(), at(mutant, place));
        else
          mutant.insert(at(mutant, place), word.begin(), word.end());
        break;
      }
      default:
        mutant.resize(place);
        break;
    }
  }

  std::vector<Bytes> inputs_;
  std::vector<std::string> words_;
  std::size_t largest_;
  std::mt19937 random_{20261122};
};

std::string hex(const Bytes& bytes) {
  std::ostringstream text;
  text << std::hex << std::setfill('0');
  for (const std::byte each : bytes) text << std::setw(2) << std::to_integer<int>(each);
  return text.str();
}

class ShortRun : public ::testing::TestWithParam<FuzzTarget> {
 protected:
  /// Whether the target takes this input as it must.
  static void run(const Bytes& input) {
    try {
      GetParam().run(input);
    } catch (const std::exception& error) {
      FAIL() << error.what() << "\ninput, hexadecimal: " << hex(input);
    }
  }
};

TEST_P(ShortRun, TakesAnyBytes) {
  std::vector<Bytes> inputs = GetParam().seeds();
  for (const Bytes& old : committed(GetParam().name)) inputs.push_back(old);
  for (const Bytes& input : inputs) run(input);
  run({});
  Mutator mutator(inputs, GetParam());
  for (long k = GetParam().executions / 2000; k > 0 && !HasFailure(); --k) run(mutator.next());
}

INSTANTIATE_TEST_SUITE_P(Fuzz, ShortRun, ::testing::ValuesIn(fuzz_targets()),
                         [](const auto& target) { return target.param.name; });

}  // namespace
}  // namespace softarm::test
