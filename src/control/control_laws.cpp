#include "softarm/control/control_laws.hpp"

#include <array>

#include "softarm/control/curvature_controller.hpp"
#include "softarm/control/settings.hpp"

namespace softarm {
namespace {

class Curvature final : public ControlLaw {
 public:
  Curvature(const ArmParameters& arm, const ControllerSettings& control)
      : controller_(arm, control) {}

  double lookahead_s() const noexcept override { return controller_.lookahead_s(); }
  void compute(const LawState& state, const ReferenceWindow& reference,
               ControlOutput& out) noexcept override {
    out.answer = LawAnswer::moments;
    controller_.compute(state.u_rad, state.velocity_radps, reference, out, state.correction);
  }
  void applied(double period_s, const LawState& state, const ReferenceSample& reference,
               ConstVectorRef scale) noexcept override {
    controller_.integrate(period_s, state.u_rad, reference, scale);
  }
  void reset() noexcept override { controller_.reset_integral(); }

 private:
  CurvatureController controller_;
};

}  // namespace

LawKind::LawKind() : LawKind(CurvatureLaw{}) {}

Registry<LawKind>& control_laws() {
  static Registry<LawKind> laws({
      CurvatureLaw{},
      StaticsPiLaw{},
      ExternalLaw{},
  });
  return laws;
}

std::unique_ptr<ControlLaw> CurvatureLaw::make(const LawSetup& setup) const {
  return std::make_unique<Curvature>(setup.arm, setup.control);
}

ControllerSettings as_statics_pi(ControllerSettings settings) {
  settings.coordinates = ControlCoordinates::u;
  settings.terms = {.inertia = false, .coriolis = false, .damping = false};
  settings.valve_lag_s = 0.0;
  return settings;
}

std::unique_ptr<ControlLaw> StaticsPiLaw::make(const LawSetup& setup) const {
  return std::make_unique<Curvature>(setup.arm, as_statics_pi(setup.control));
}

std::unique_ptr<ControlLaw> ExternalLaw::make(const LawSetup& setup) const {
  return std::make_unique<ExternalLawInput>(setup);
}

const char* name(LawVerdict verdict) noexcept {
  constexpr std::array kNames{"accepted",   "not_recent",    "out_of_order", "wrong_size",
                              "not_finite", "out_of_limits", "expired"};
  static_assert(kNames.size() == static_cast<std::size_t>(kLawVerdicts));
  const auto index = static_cast<std::size_t>(verdict);
  return index < kNames.size() ? kNames[index] : "unknown";
}

ExternalLawInput::ExternalLawInput(const LawSetup& setup)
    : force_nm_(SegmentVector::Zero(setup.arm.dof())),
      pressure_bar_(PressureVector::Zero(setup.chambers)) {}

LawVerdict ExternalLawInput::take(LawAnswer answer, ConstVectorRef values) noexcept {
  const bool pressures = answer == LawAnswer::pressures;
  if (values.size() != (pressures ? pressure_bar_.size() : force_nm_.size()))
    return LawVerdict::wrong_size;
  if (!values.allFinite()) return LawVerdict::not_finite;
  answer_ = answer;
  if (pressures) {
    pressure_bar_ = values;
  } else {
    force_nm_ = values;
  }
  return LawVerdict::accepted;
}

void ExternalLawInput::compute(const LawState&, const ReferenceWindow&,
                               ControlOutput& out) noexcept {
  out.answer = answer_;
  if (answer_ == LawAnswer::pressures) {
    out.pressure_bar = pressure_bar_;
  } else {
    out.tau_u_nm = force_nm_;
  }
}

}  // namespace softarm
