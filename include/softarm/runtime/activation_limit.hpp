// How often an arm was pressurised again without an operator.
#pragma once

#include <cstdint>

#include "softarm/runtime/safety_monitor.hpp"
#include "softarm/runtime/settings.hpp"

namespace softarm {

/// An arm that inflates and vents again and again does harm that no single cause shows. After
/// most_activations from vented within a minute it needs an operator's `arm`. The minute begins with
/// the first activation after the previous minute, or after an `arm`. No allocation, no clock.
class ActivationLimit {
 public:
  explicit ActivationLimit(const SafetySettings& settings) noexcept
      : most_(settings.most_activations) {}

  /// Whether a vented arm may not be activated again without an `arm`.
  bool reached(std::int64_t now_ns, const SafetyMonitor& monitor) const noexcept {
    return monitor.mode() == Mode::vent && monitor.armed() && activations_ >= most_ &&
           now_ns - since_ns_ <= kMinute_ns;
  }

  /// After the monitor's step, `before` its mode before that; `arm`: an operator's request.
  void note(std::int64_t now_ns, Mode before, bool arm, const SafetyMonitor& monitor) noexcept {
    if (arm && monitor.armed()) activations_ = 0;
    if (monitor.mode() != Mode::active || before == Mode::active || before == Mode::hold) return;
    if (activations_ == 0 || now_ns - since_ns_ > kMinute_ns) {
      activations_ = 0;
      since_ns_ = now_ns;
    }
    ++activations_;
  }

 private:
  static constexpr std::int64_t kMinute_ns = 60'000'000'000;
  int most_;
  int activations_ = 0;
  std::int64_t since_ns_ = 0;
};

}  // namespace softarm
