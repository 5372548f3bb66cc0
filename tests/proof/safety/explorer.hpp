// Breadth-first exploration of a deterministic object: each state that differs is visited once.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <optional>
#include <type_traits>
#include <unordered_set>
#include <vector>

namespace softarm::proof {

/// Times of a proof begin here. No other 8-byte word of an explored object is close to it: as a
/// floating-point number it would be 1e-241, as two 32-bit integers their upper half 2.3e8.
inline constexpr std::int64_t kEpoch_ns = 1'000'000'000'000'000'000;
inline constexpr std::int64_t kSpan_ns = 1'000'000'000'000'000;  // 11 days

/// The state of an object as words that do not change when all its times are shifted together: each
/// word that is a time is replaced by its distance from now, limited to the horizon.
template <class State>
class Key {
  static_assert(std::is_trivially_copyable_v<State> && sizeof(State) % 8 == 0);

 public:
  Key(const State& state, std::int64_t now_ns, std::int64_t horizon_ns) noexcept {
    std::memcpy(words_.data(), &state, sizeof(State));
    for (std::uint64_t& word : words_) {
      const auto time_ns = static_cast<std::int64_t>(word);
      if (time_ns >= kEpoch_ns && time_ns < kEpoch_ns + kSpan_ns)
        word = static_cast<std::uint64_t>(kEpoch_ns + kSpan_ns +
                                          std::clamp(time_ns - now_ns, -horizon_ns, horizon_ns));
      hash_ = (hash_ ^ word) * 0x9e3779b97f4a7c15ULL;
      hash_ ^= hash_ >> 29;
    }
  }
  bool operator==(const Key& other) const noexcept { return words_ == other.words_; }
  struct Hash {
    std::size_t operator()(const Key& key) const noexcept { return key.hash_; }
  };

 private:
  std::array<std::uint64_t, sizeof(State) / 8> words_;
  std::uint64_t hash_ = 0;
};

/// What to visit: states in the order in which they were found, with the state before and the input
/// between, so that a violation is shown with a shortest way to it.
template <class State, class Input>
class Frontier {
 public:
  explicit Frontier(std::int64_t horizon_ns) : horizon_ns_(horizon_ns) {}

  /// Adds a state unless an equal one is known.
  void add(const State& state, std::int64_t now_ns, std::size_t from, const Input& input) {
    // Most inputs lead where the one before has led.
    if (newest_ && std::memcmp(&state, &*newest_, sizeof(State)) == 0) return;
    newest_ = state;
    if (known_.emplace(state, now_ns, horizon_ns_).second) visits_.push_back({state, from, input});
  }
  std::size_t size() const noexcept { return visits_.size(); }
  const State& operator[](std::size_t index) const noexcept { return visits_[index].state; }
  /// Inputs from the first state to that of `index`.
  std::vector<Input> way_to(std::size_t index) const {
    std::vector<Input> way;
    for (; index != 0; index = visits_[index].from) way.push_back(visits_[index].input);
    std::reverse(way.begin(), way.end());
    return way;
  }

 private:
  struct Visit {
    State state;
    std::size_t from;
    Input input;
  };
  std::int64_t horizon_ns_;
  std::unordered_set<Key<State>, typename Key<State>::Hash> known_;
  std::vector<Visit> visits_;
  std::optional<State> newest_;
};

}  // namespace softarm::proof
