// A kind of reference behind one interface: what `kind:` of a phase names. A new one is a type with
// the members below and one line:
//
//   struct Spiral {
//     double rate_radps = 1.0;
//     const char* name() const noexcept { return "spiral"; }
//     void describe(Keys& key) { key("rate_radps", rate_radps, from(0, 10), "of phi"); }
//     void check(const ReferencePlace& place, const ControllerSettings& control,
//                int segments) const;  // place.require(rate_radps < 10, "less than 10", "more")
//     double largest_theta_rad() const noexcept;
//     double largest_speed_radps() const noexcept;
//     void evaluate(double time_s, ReferenceSample& out) const noexcept;
//   };
//   const ReferenceRegistration kSpiral(Spiral{});
#pragma once

#include <initializer_list>
#include <stdexcept>
#include <string>

#include "softarm/base/kind.hpp"
#include "softarm/control/inverse_kinematics.hpp"
#include "softarm/model/arm.hpp"

namespace softarm {

/// A reference at one time: 2n numbers each; rad, rad/s, rad/s^2. Reference gives 3n where segments
/// stretch, with e (m, m/s, m/s^2) as every third.
struct ReferenceSample {
  SegmentVector u;
  SegmentVector velocity;
  SegmentVector acceleration;
  /// The same in polar coordinates [phi, theta] a segment, where the reference knows them without
  /// dividing by theta
  /// ((24) outside of a blend); otherwise has_polar is false and they are unspecified.
  bool has_polar = false;
  SegmentVector polar;
  SegmentVector polar_velocity;
  SegmentVector polar_acceleration;
  bool limited = false;  ///< a soft limit (theta or speed) bent this sample, or could not
  /// Where the tip should be, in a phase that is given in task space; joining not counted.
  bool has_tip = false;
  TipReference tip;
};

/// A reference now and a little before and after, for the derivative that inverts the valve lag.
struct ReferenceWindow {
  ReferenceSample now;
  ReferenceSample before;
  ReferenceSample after;
  double interval_s = 0.0;  ///< time from `before` to `after`; 0: only `now` is filled in
};

/// What is wrong with a phase of a reference. what() is "reference[1].points[2].time_s: expected X,
/// got Y", with the key that an experiment has there.
class ReferenceError : public std::invalid_argument {
 public:
  /// @param place  within the phase, such as ".points[2].time_s"; empty: the phase as a whole
  ReferenceError(int phase, const std::string& place, std::string expected_text,
                 std::string got_text);

  std::string key, expected, got;
};

/// A place within a phase, for what is wrong there.
struct ReferencePlace {
  int phase = 0;
  std::string at = "";  ///< as ReferenceError has it

  /// @throws ReferenceError unless it holds
  void require(bool holds, const std::string& expected_text, const std::string& got_text) const {
    if (!holds) throw ReferenceError(phase, at, expected_text, got_text);
  }
  void require_finite(std::initializer_list<double> values) const;
};

struct ControllerSettings;

/// What every kind has. One that repeats has `double period_s() const noexcept` (0: it does not
/// after all), from where on control.repetition knows it. A kind that is a path of the tip or not as its settings say has both sets of
/// functions and `bool is_tip_path() const noexcept`. `check` throws ReferenceError for settings that do not fit the limits or an
/// arm of so many segments.
template <class K>
concept AnyReference = requires(const K& kind, const ReferencePlace& place,
                                const ControllerSettings& control, int segments) {
  { kind.name() }
  noexcept->std::convertible_to<const char*>;
  kind.check(place, control, segments);
};

/// A motion of the curvatures, known beforehand. `evaluate` is called in the tick with the time (s)
/// since the phase began: it fills u, velocity and acceleration of `out`, which have their size
/// 2n, and does not allocate. theta (rad) and |u'| of a segment (rad/s) never exceed what
/// `largest_theta_rad` and `largest_speed_radps` return; where these exceed the controller's
/// limits, the configuration is refused.
template <class K>
concept CurvatureReference = AnyReference<K> &&
    requires(const K& kind, double time_s, ReferenceSample& out) {
  { kind.evaluate(time_s, out) }
  noexcept;
  { kind.largest_theta_rad() }
  noexcept->std::same_as<double>;
  { kind.largest_speed_radps() }
  noexcept->std::same_as<double>;
};

/// A path of the tip in the world, followed by (21). `tip` is called in the tick with the time (s)
/// since the phase began and does not allocate.
template <class K>
concept TipReferencePath = AnyReference<K> && requires(const K& kind, double time_s) {
  { kind.tip(time_s) }
  noexcept->std::same_as<TipReference>;
};

struct LiveReference;  // what comes from outside: Reference itself knows how to follow it

/// What a kind of reference is, behind ReferenceKind.
class ReferenceInterface {
 public:
  virtual ~ReferenceInterface() = default;
  virtual const char* name() const noexcept = 0;
  virtual std::shared_ptr<const ReferenceInterface> described(Keys& key) const = 0;
  virtual void check(const ReferencePlace& place, const ControllerSettings& control,
                     int segments) const = 0;
  virtual double largest_theta_rad() const noexcept = 0;
  virtual double largest_speed_radps() const noexcept = 0;
  virtual void evaluate(double time_s, ReferenceSample& out) const noexcept = 0;
  virtual double period_s() const noexcept = 0;
  virtual bool is_tip_path() const noexcept = 0;
  virtual TipReference tip(double time_s) const noexcept = 0;
};

/// One kind with its settings.
class ReferenceKind : public NamedKind<ReferenceInterface> {
 public:
  ReferenceKind();  ///< a set point

  template <class K>
  requires CurvatureReference<K> || TipReferencePath<K> || std::same_as<K, LiveReference>
  ReferenceKind(K kind) : NamedKind(std::make_shared<Model<K>>(std::move(kind))) {}

  void check(const ReferencePlace& place, const ControllerSettings& control, int segments) const {
    model().check(place, control, segments);
  }
  /// What a path of the tip and a live reference reach is not known beforehand: 0.
  double largest_theta_rad() const noexcept { return model().largest_theta_rad(); }
  double largest_speed_radps() const noexcept { return model().largest_speed_radps(); }

  void evaluate(double time_s, ReferenceSample& out) const noexcept {
    model().evaluate(time_s, out);
  }
  /// After which it repeats, s; 0: not, or not that it is known.
  double period_s() const noexcept { return model().period_s(); }
  bool is_tip_path() const noexcept { return model().is_tip_path(); }
  /// Of a path of the tip.
  TipReference tip(double time_s) const noexcept { return model().tip(time_s); }

 private:
  template <class K>
  struct Model final : Holder<K> {
    using Holder<K>::Holder;
    using Holder<K>::value;

    std::shared_ptr<const ReferenceInterface> described(Keys& key) const override {
      return this->template described_as<Model>(key);
    }
    void check(const ReferencePlace& place, const ControllerSettings& control,
               int segments) const override {
      value.check(place, control, segments);
    }
    double largest_theta_rad() const noexcept override {
      if constexpr (CurvatureReference<K>) return value.largest_theta_rad();
      return 0.0;
    }
    double largest_speed_radps() const noexcept override {
      if constexpr (CurvatureReference<K>) return value.largest_speed_radps();
      return 0.0;
    }
    void evaluate(double time_s, ReferenceSample& out) const noexcept override {
      if constexpr (CurvatureReference<K>) value.evaluate(time_s, out);
    }
    double period_s() const noexcept override {
      if constexpr (requires { value.period_s(); }) return value.period_s();
      return 0.0;
    }
    bool is_tip_path() const noexcept override {
      if constexpr (requires { value.is_tip_path(); }) return value.is_tip_path();
      return TipReferencePath<K>;
    }
    TipReference tip(double time_s) const noexcept override {
      if constexpr (TipReferencePath<K>) return value.tip(time_s);
      return {};
    }
  };
};

/// The kinds that a configuration may name, with their default settings.
Registry<ReferenceKind>& reference_kinds();

/// Adds a kind: the one line that it takes in a program of one's own.
struct ReferenceRegistration {
  explicit ReferenceRegistration(ReferenceKind kind) { reference_kinds().add(std::move(kind)); }
};

}  // namespace softarm
