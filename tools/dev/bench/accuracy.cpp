#include "dev/bench/accuracy.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "softarm/model/polar.hpp"

namespace softarm {
namespace {

using reference::Real;

/// Below this theta the paper's polar controller is bounded, and KDL's chain loses digits.
constexpr double kSmallestPolarTheta = 0.05;

reference::Vector exact(const Eigen::Ref<const Eigen::VectorXd>& v) { return v.cast<Real>(); }

bool covers(const Method& method, const KnownState& known) {
  if (method.polar != known.polar || method.mass != known.arm.mass) return false;
  const bool divides = method.route == Route::controller || method.route == Route::kdl_matrices ||
                       method.route == Route::kdl_inverse_dynamics;
  if (!method.polar || !divides) return method.route != Route::kdl_maps;
  for (int i = 1; i < known.state.q.size(); i += 2) {
    if (known.state.q(i) < kSmallestPolarTheta) return false;
    // The controller takes the short way round; the golden file never wraps.
    const double turn = known.state.reference.now.polar(i - 1) - known.state.q(i - 1);
    if (method.route == Route::controller && std::abs(turn) >= 3.1) return false;
  }
  return true;
}

double relative(const reference::Matrix& got, const reference::Matrix& want, Real scale) {
  if (!got.allFinite()) return std::numeric_limits<double>::quiet_NaN();
  const Real error = (got - want).cwiseAbs().maxCoeff();
  return static_cast<double>(error == 0 ? error : error / scale);
}

/// NaN stays.
double larger(double a, double b) { return std::isnan(a) || a > b ? a : b; }

double vector_error(const Eigen::VectorXd& got, const reference::Vector& want,
                    const reference::Vector& scale) {
  return relative(exact(got), want, scale.maxCoeff());
}

double matrices_error(const MethodResult& got, const reference::Dynamics& want) {
  const Real s = want.s.maxCoeff();
  return larger(relative(got.B.cast<Real>(), want.B, s * s),
                larger(relative(got.C.cast<Real>(), want.C, s * want.r.maxCoeff()),
                       relative(exact(got.G), want.G, s * want.w)));
}

double kdl_error(const MethodResult& got, const KnownState& known) {
  const reference::Dynamics& want = known.terms;
  const reference::Vector v = exact(known.state.q_velocity);
  const Real s = want.s.maxCoeff();
  return larger(relative(got.B.cast<Real>(), want.B, s * s),
                larger(relative(got.C.cast<Real>(), want.C * v, s * want.r.dot(v.cwiseAbs())),
                       relative(exact(got.G), want.G, s * want.w)));
}

/// (17) before A^-1, in the state's own coordinates.
double controller_error(const Eigen::VectorXd& got_u, const KnownState& known) {
  const BenchState& state = known.state;
  const ReferenceSample& r = state.reference.now;
  const bool polar = known.polar;
  const reference::Vector q = exact(polar ? state.q : state.u),
                          v = exact(polar ? state.q_velocity : state.velocity),
                          q_ref = exact(polar ? r.polar : r.u),
                          v_ref = exact(polar ? r.polar_velocity : r.velocity),
                          a_ref = exact(polar ? r.polar_acceleration : r.acceleration);
  reference::Vector tau = reference::inverse_dynamics(known.terms, v_ref, a_ref);
  reference::Vector scale = reference::inverse_dynamics_scale(known.terms, v_ref, a_ref);
  const auto add = [&](Eigen::Index i, Real x) {
    tau(i) += x;
    scale(i) += std::abs(x);
  };
  for (Eigen::Index i = 0; i < q.size(); ++i) {
    const auto at = static_cast<std::size_t>(i);
    const SegmentParameters& segment = known.arm.segments[at / 2];
    const bool phi = polar && i % 2 == 0;
    const Real theta = phi ? q(i + 1) : 1;
    if (!phi) add(i, segment.stiffness_nm_per_rad * q_ref(i));
    add(i, segment.damping_nms_per_rad * theta * theta * v_ref(i));
    add(i, known.kp[at] * (q_ref(i) - q(i)));
    add(i, known.kd[at] * (v_ref(i) - v(i)));
  }
  Eigen::VectorXd got = got_u;
  if (polar) force_to_polar(state.q, got_u, got);
  return vector_error(got, tau, scale);
}

double error_of(const Method& method, const KnownState& known) {
  ControllerSettings settings = bench_controller(method, known.arm.size());
  settings.kp = known.kp;
  settings.kd = known.kd;
  const auto evaluator = make_evaluator(method, known.arm, settings);
  evaluator->evaluate(known.state);
  const MethodResult got = evaluator->result();
  const ReferenceSample& r = known.state.reference.now;
  switch (method.route) {
    case Route::augmented:
    case Route::matrices:
      return matrices_error(got, known.terms);
    case Route::recursion: {
      const reference::Vector y = exact(r.velocity), x = exact(r.acceleration);
      return vector_error(got.G, reference::inverse_dynamics(known.terms, y, x),
                          reference::inverse_dynamics_scale(known.terms, y, x));
    }
    case Route::controller:
      return controller_error(got.G, known);
    case Route::kdl_matrices:
      return kdl_error(got, known);
    case Route::kdl_inverse_dynamics: {
      const reference::Vector y = exact(known.state.q_velocity),
                              x = exact(known.state.q_acceleration);
      return vector_error(got.G, reference::inverse_dynamics(known.terms, y, x),
                          reference::inverse_dynamics_scale(known.terms, y, x));
    }
    case Route::kdl_maps:
      break;
  }
  return std::numeric_limits<double>::quiet_NaN();
}

}  // namespace

LargestError largest_error(const Method& method, const std::vector<KnownState>& states) {
  LargestError result;
  for (const KnownState& known : states) {
    if (!covers(method, known)) continue;
    ++result.states;
    result.relative = larger(error_of(method, known), result.relative);
  }
  return result;
}

}  // namespace softarm
