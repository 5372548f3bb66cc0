// The control laws that are built in.
// config/template.yaml documents every setting.
#pragma once

#include <cstdint>
#include <memory>

#include "softarm/control/control_law.hpp"

namespace softarm {

/// (17), in u or in the paper's polar coordinates, with everything that section `control` has.
struct CurvatureLaw {
  const char* name() const noexcept { return "curvature"; }
  std::unique_ptr<ControlLaw> make(const LawSetup& setup) const;
};

/// Static feed-forward and PI: G(u) + K u_ref + K_P e + K_D e' + K_I times the integral of e, which
/// is what (17) leaves without B, C, D and the inverse of the valve lag. The kinematic control of a
/// calibrated arm, to compare with.
struct StaticsPiLaw {
  const char* name() const noexcept { return "statics_pi"; }
  std::unique_ptr<ControlLaw> make(const LawSetup& setup) const;
};

/// The settings with which (17) is that law.
ControllerSettings as_statics_pi(ControllerSettings settings);

/// A law in another process: law_state_t there, law_command_t back.
struct ExternalLaw {
  const char* name() const noexcept { return "external"; }
  std::unique_ptr<ControlLaw> make(const LawSetup& setup) const;
};

/// Why a command of an external law counts for nothing. The numbers go over the wire.
enum class LawVerdict : std::int8_t {
  accepted,
  not_recent,     ///< answers no state of the last second of this daemon
  out_of_order,   ///< its sequence is not above that of the newest
  wrong_size,     ///< not as many forces as the state has numbers, or not one pressure a chamber
  not_finite,     ///< a NaN or an infinity
  out_of_limits,  ///< a pressure the valves cannot have, or a force far beyond what chambers give
  expired         ///< its validity, counted from the state that it answers, has passed
};
inline constexpr int kLawVerdicts = static_cast<int>(LawVerdict::expired) + 1;
/// "accepted", "not_recent", ...; "unknown" for a value outside the enumeration.
const char* name(LawVerdict verdict) noexcept;

/// The daemon's end of an external law: holds the newest answer.
class ExternalLawInput final : public ControlLaw {
 public:
  explicit ExternalLawInput(const LawSetup& setup);

  /// Takes an answer of so many numbers, forces or pressures, if these are finite and as many as
  /// there should be. Their limits are judged before.
  LawVerdict take(LawAnswer answer, ConstVectorRef values) noexcept;

  void compute(const LawState& state, const ReferenceWindow& reference,
               ControlOutput& out) noexcept override;

 private:
  LawAnswer answer_ = LawAnswer::force;
  SegmentVector force_nm_;
  PressureVector pressure_bar_;
};

}  // namespace softarm
