// A control law behind one interface: what `control.law` names. A new one is a class, its settings
// and one line:
//
//   class Softness final : public ControlLaw {
//    public:
//     explicit Softness(const LawSetup& setup, double gain) ...
//     void compute(const LawState& state, const ReferenceWindow& reference,
//                  ControlOutput& out) noexcept override {
//       out.tau_u_nm = gain_ * (reference.now.u - state.u_rad);
//     }
//   };
//   struct SoftnessSettings {
//     double gain_nm_per_rad = 1.0;
//     const char* name() const noexcept { return "softness"; }
//     void describe(Keys& key) {
//       key("gain_nm_per_rad", gain_nm_per_rad, from(0, 100), "of u_ref - u");
//     }
//     std::unique_ptr<ControlLaw> make(const LawSetup& setup) const {
//       return std::make_unique<Softness>(setup, gain_nm_per_rad);
//     }
//   };
//   const LawRegistration kSoftness(SoftnessSettings{});
#pragma once

#include <memory>

#include "softarm/base/kind.hpp"
#include "softarm/control/reference_kind.hpp"
#include "softarm/model/arm.hpp"
#include "softarm/model/chambers.hpp"
#include "softarm/model/model_correction.hpp"

namespace softarm {

struct ControllerSettings;

/// The estimated state that a law acts on: 2n numbers each, 3n where segments stretch, of the
/// instant at which its command acts.
struct LawState {
  const SegmentVector& u_rad;
  const SegmentVector& velocity_radps;
  /// Of the model, where a model-based observer runs; null otherwise.
  const ModelCorrection* correction = nullptr;
};

/// Which part of a ControlOutput is the law's answer.
enum class LawAnswer {
  force,    ///< tau_u_nm
  moments,  ///< tau_actuation_nm, solved from tau_u_nm by the law itself
  pressures
};

/// What a law asks of the actuation.
struct ControlOutput {
  /// Generalized force in u (N m), 2n; 3n where segments stretch, every third in N: with `force` the pipeline solves A(u) tau_A = tau_u.
  SegmentVector tau_u_nm;
  /// (tau_x, tau_y) about the local axes of every segment (N m), 2n.
  SegmentVector tau_actuation_nm;
  /// Set points of all chambers (bar), limited by the pipeline; N m with actuation by torque.
  PressureVector pressure_bar;
  LawAnswer answer = LawAnswer::force;
  bool bounded = false;  ///< near a singularity (sin theta = 0 of A_couple, theta = 0 in polar)
                         ///< something was bounded
};

/// A control law. It is constructed before the loop begins; its functions are called in the tick
/// while the arm is ACTIVE: no allocation, no lock, no clock, no exception, bounded work.
class ControlLaw {
 public:
  virtual ~ControlLaw() = default;

  /// How far before and after now the reference is needed (s); 0: only now.
  virtual double lookahead_s() const noexcept { return 0.0; }

  /// Fills the part of `out` that `out.answer` names; it comes with the sizes and the content of
  /// the call before, `answer` and `bounded` with their defaults.
  virtual void compute(const LawState& state, const ReferenceWindow& reference,
                       ControlOutput& out) noexcept = 0;

  /// What became of it, for a law that integrates. scale: n, the part of every segment's moments
  /// that the chambers can give; where it is below 1, more of the same does nothing.
  virtual void applied(double period_s, const LawState& state, const ReferenceSample& reference,
                       ConstVectorRef scale) noexcept {
    static_cast<void>(period_s), static_cast<void>(state), static_cast<void>(reference),
        static_cast<void>(scale);
  }

  /// The arm becomes ACTIVE: forgets what was gathered.
  virtual void reset() noexcept {}
};

/// What a law is made from.
struct LawSetup {
  const ArmParameters& arm;
  const ControllerSettings& control;
  int chambers = 0;  ///< of the whole arm; 2n with actuation by torque
};

/// `make` throws std::invalid_argument "control, KEY: expected X, got Y" for settings that cannot be.
template <class K>
concept AnyLaw = requires(const K& kind, const LawSetup& setup) {
  { kind.name() }
  noexcept->std::convertible_to<const char*>;
  { kind.make(setup) } -> std::same_as<std::unique_ptr<ControlLaw>>;
};

/// What a kind of law is, behind LawKind.
class LawInterface {
 public:
  virtual ~LawInterface() = default;
  virtual const char* name() const noexcept = 0;
  virtual bool has_keys() const noexcept = 0;
  virtual std::shared_ptr<const LawInterface> described(Keys& key) const = 0;
  virtual std::unique_ptr<ControlLaw> make(const LawSetup& setup) const = 0;
};

/// One kind with its own settings.
class LawKind : public NamedKind<LawInterface> {
 public:
  LawKind();  ///< curvature

  template <AnyLaw K>
  LawKind(K kind) : NamedKind(std::make_shared<Model<K>>(std::move(kind))) {}

  /// Whether a configuration has a section `control.NAME` for it.
  bool has_keys() const noexcept { return model().has_keys(); }
  std::unique_ptr<ControlLaw> make(const LawSetup& setup) const { return model().make(setup); }

 private:
  template <class K>
  struct Model final : Holder<K> {
    using Holder<K>::Holder;
    bool has_keys() const noexcept override { return HasKeys<K>; }
    std::shared_ptr<const LawInterface> described(Keys& key) const override {
      return this->template described_as<Model>(key);
    }
    std::unique_ptr<ControlLaw> make(const LawSetup& setup) const override {
      return this->value.make(setup);
    }
  };
};

/// The laws that a configuration may name, with their default settings.
Registry<LawKind>& control_laws();

/// Adds a law: the one line that it takes in a program of one's own.
struct LawRegistration {
  explicit LawRegistration(LawKind kind) { control_laws().add(std::move(kind)); }
};

}  // namespace softarm
