// What is fed with hostile bytes: every reader of something that others wrote. libFuzzer
// (libfuzzer.cpp, tools/fuzz) and the short runs of the tests (short/) drive the same targets.
#pragma once

#include <cstddef>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

namespace softarm::test {

using Bytes = std::vector<std::byte>;

/// Something that must hold of every input did not.
class BrokenProperty : public std::runtime_error {
  using std::runtime_error::runtime_error;
};
inline void require(bool holds, const char* property) {
  if (!holds) throw BrokenProperty(property);
}

struct FuzzTarget {
  std::string name;
  /// Takes any bytes. Throws BrokenProperty, and nothing else.
  void (*run)(std::span<const std::byte> input);
  /// Good inputs to begin with.
  std::vector<Bytes> (*seeds)();
  /// What mutations put in at once, because single bytes seldom make it.
  std::vector<std::string> (*words)();
  std::size_t largest;  ///< bytes of an input
  /// Executions of a long run.
  long executions;
};

/// All of them; a new decoder is one line there.
const std::vector<FuzzTarget>& fuzz_targets();

inline Bytes to_bytes(std::span<const std::byte> bytes) { return {bytes.begin(), bytes.end()}; }
inline Bytes to_bytes(const std::string& text) {
  return to_bytes(std::as_bytes(std::span(text.data(), text.size())));
}
inline std::string to_text(std::span<const std::byte> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

void run_optitrack(std::span<const std::byte> input);
std::vector<Bytes> optitrack_seeds();
void run_mocap(std::span<const std::byte> input);
std::vector<Bytes> mocap_seeds();
void run_natnet(std::span<const std::byte> input);
std::vector<Bytes> natnet_seeds();
void run_qtm(std::span<const std::byte> input);
std::vector<Bytes> qtm_seeds();
std::vector<std::string> qtm_words();
void run_yaml(std::span<const std::byte> input);
std::vector<Bytes> yaml_seeds();
std::vector<std::string> yaml_words();
void run_log(std::span<const std::byte> input);
std::vector<Bytes> log_seeds();
std::vector<std::string> log_words();
void run_replay(std::span<const std::byte> input);
std::vector<Bytes> replay_seeds();
std::vector<std::string> replay_words();
void run_recording(std::span<const std::byte> input);
std::vector<Bytes> recording_seeds();
std::vector<std::string> recording_words();
void run_table(std::span<const std::byte> input);
std::vector<Bytes> table_seeds();
std::vector<std::string> table_words();
void run_timeline(std::span<const std::byte> input);
std::vector<Bytes> timeline_seeds();
void run_frames(std::span<const std::byte> input);
std::vector<Bytes> frames_seeds();

}  // namespace softarm::test
