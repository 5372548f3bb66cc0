#include "control/reference_curves.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <utility>

namespace softarm {
namespace {

using std::numbers::pi;

template <class... Functions>
struct Overloaded : Functions... {
  using Functions::operator()...;
};
template <class... Functions>
Overloaded(Functions...) -> Overloaded<Functions...>;

void rest_at(const std::vector<double>& u_rad, ReferenceSample& out) noexcept {
  for (Eigen::Index i = 0; i < out.u.size(); ++i) out.u[i] = u_rad[static_cast<std::size_t>(i)];
  out.velocity.setZero();
  out.acceleration.setZero();
  out.has_polar = false;
}

double largest_theta(const std::vector<double>& u_rad) noexcept {
  double theta = 0.0;
  for (std::size_t i = 0; i + 1 < u_rad.size(); i += 2) {
    theta = std::max(theta, std::hypot(u_rad[i], u_rad[i + 1]));
  }
  return theta;
}

double largest_distance(const std::vector<double>& a, const std::vector<double>& b) noexcept {
  double distance = 0.0;
  for (std::size_t i = 0; i + 1 < std::min(a.size(), b.size()); i += 2) {
    distance = std::max(distance, std::hypot(b[i] - a[i], b[i + 1] - a[i + 1]));
  }
  return distance;
}

/// A place within a phase, for what is wrong there.
struct Place {
  int phase;
  std::string at = "";

  void require(bool holds, const std::string& expected, const std::string& got) const {
    if (!holds) throw ReferenceError(phase, at, expected, got);
  }
  void require_finite(std::initializer_list<double> values) const {
    for (const double value : values)
      require(std::isfinite(value), "finite numbers", fmt::format("{}", value));
  }
};

void check_u(const Place& place, const std::vector<double>& u_rad,
             const ControllerSettings& control, int segments) {
  place.require(u_rad.size() == static_cast<std::size_t>(2 * segments),
                fmt::format("u of {} numbers (2 a segment)", 2 * segments),
                fmt::format("{}", u_rad.size()));
  for (const double value : u_rad) place.require_finite({value});
  const double theta = largest_theta(u_rad);
  place.require(theta <= control.max_theta_rad,
                fmt::format("theta within control.max_theta_rad ({} rad)", control.max_theta_rad),
                fmt::format("{:.6g} rad", theta));
}

void check(const Place& place, const SetPointReference& r, const ControllerSettings& control,
           int segments) {
  check_u(place, r.u_rad, control, segments);
}

void check(const Place& place, const PaperReference& r, const ControllerSettings& control, int) {
  place.require_finite({r.theta_rad, r.rise_s, r.phi_centre_rad, r.phi_amplitude_rad, r.rate_radps,
                        r.phase_step_rad});
  place.require(r.theta_rad >= 0.0 && r.rise_s >= 0.0, "theta (rad) and rise time (s) >= 0",
                fmt::format("{} and {}", r.theta_rad, r.rise_s));
  Place{place.phase, ".theta_rad"}.require(
      r.theta_rad <= control.max_theta_rad,
      fmt::format("at most control.max_theta_rad ({} rad)", control.max_theta_rad),
      fmt::format("{} rad", r.theta_rad));
}

void check(const Place& place, const WayPointReference& r, const ControllerSettings& control,
           int segments) {
  place.require(!r.points.empty(), "at least one way point", "none");
  for (std::size_t i = 0; i < r.points.size(); ++i) {
    const double time_s = r.points[i].time_s;
    const Place point{place.phase, fmt::format(".points[{}]", i)};
    check_u(point, r.points[i].u_rad, control, segments);
    const Place time{place.phase, point.at + ".time_s"};
    time.require_finite({time_s});
    time.require(time_s >= 0.0, "at least 0 s", fmt::format("{} s", time_s));
    time.require(i == 0 || time_s > r.points[i - 1].time_s, "later than the point before",
                 fmt::format("{} s", time_s));
  }
  if (!r.repeat) return;
  const Place points{place.phase, ".points"};
  points.require(r.points.size() >= 2, "at least 2 points to repeat",
                 fmt::format("{}", r.points.size()));
  const double apart = largest_distance(r.points.front().u_rad, r.points.back().u_rad);
  points.require(apart <= 1e-9, "the last way point to equal the first, since they repeat",
                 fmt::format("one {:.3g} rad away", apart));
}

void check(const Place& place, const LiveReference& r, const ControllerSettings&, int) {
  place.require(std::isfinite(r.timeout_s) && r.timeout_s >= 0.0, "a timeout (s) >= 0",
                fmt::format("{}", r.timeout_s));
}

void check(const Place& place, const TipPathReference& r, const ControllerSettings&, int) {
  place.require(r.centre_m.allFinite() && r.first_axis_m.allFinite() &&
                    r.second_axis_m.allFinite() && std::isfinite(r.rate_radps),
                "a path of finite numbers", "one that is not");
}

}  // namespace

void evaluate(const SetPointReference& curve, double, ReferenceSample& out) noexcept {
  rest_at(curve.u_rad, out);
}

// (24) in polar coordinates, then u = theta n, u' = theta' n + theta phi' t,
// u'' = (theta'' - theta phi'^2) n + (2 theta' phi' + theta phi'') t with n = (cos, sin) phi, t =
// (-sin, cos) phi.
void evaluate(const PaperReference& curve, double time_s, ReferenceSample& out) noexcept {
  double theta = curve.theta_rad, theta_d = 0.0, theta_dd = 0.0;
  if (time_s < curve.rise_s) {
    const double rate = pi / curve.rise_s, angle = rate * time_s;
    // theta (1 - cos) / 2 without cancellation near the start.
    theta = curve.theta_rad * std::pow(std::sin(0.5 * angle), 2);
    theta_d = 0.5 * curve.theta_rad * rate * std::sin(angle);
    theta_dd = 0.5 * curve.theta_rad * rate * rate * std::cos(angle);
  }
  const Eigen::Index n = out.u.size() / 2;
  out.has_polar = true;
  out.polar.resize(2 * n);
  out.polar_velocity.resize(2 * n);
  out.polar_acceleration.resize(2 * n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const double rate = curve.rate_radps, amplitude = curve.phi_amplitude_rad;
    const double angle = rate * time_s + static_cast<double>(i) * curve.phase_step_rad;
    const double phi = curve.phi_centre_rad + amplitude * std::cos(angle);
    const double phi_d = -amplitude * rate * std::sin(angle);
    const double phi_dd = -amplitude * rate * rate * std::cos(angle);
    const Eigen::Vector2d normal(std::cos(phi), std::sin(phi)), tangent(-normal[1], normal[0]);
    out.u.segment<2>(2 * i) = theta * normal;
    out.velocity.segment<2>(2 * i) = theta_d * normal + theta * phi_d * tangent;
    out.acceleration.segment<2>(2 * i) = (theta_dd - theta * phi_d * phi_d) * normal +
                                         (2.0 * theta_d * phi_d + theta * phi_dd) * tangent;
    out.polar.segment<2>(2 * i) << phi, theta;
    out.polar_velocity.segment<2>(2 * i) << phi_d, theta_d;
    out.polar_acceleration.segment<2>(2 * i) << phi_dd, theta_dd;
  }
}

void evaluate(const WayPointReference& curve, double time_s, ReferenceSample& out) noexcept {
  const std::vector<WayPoint>& points = curve.points;
  const double first = points.front().time_s, last = points.back().time_s;
  double time = time_s;
  if (curve.repeat && time > last) time = first + std::fmod(time - first, last - first);
  const auto next = std::upper_bound(points.begin(), points.end(), time,
                                     [](double t, const WayPoint& p) { return t < p.time_s; });
  if (next == points.begin()) return rest_at(points.front().u_rad, out);
  if (next == points.end()) return rest_at(points.back().u_rad, out);
  const WayPoint& from = *(next - 1);
  const double rate = 1.0 / (next->time_s - from.time_s), x = (time - from.time_s) * rate;
  const double s = x * x * x * (10.0 - x * (15.0 - 6.0 * x));
  const double s_d = 30.0 * rate * x * x * (1.0 - x) * (1.0 - x);
  const double s_dd = 60.0 * rate * rate * x * (1.0 - x) * (1.0 - 2.0 * x);
  for (Eigen::Index i = 0; i < out.u.size(); ++i) {
    const auto k = static_cast<std::size_t>(i);
    const double way = next->u_rad[k] - from.u_rad[k];
    out.u[i] = from.u_rad[k] + s * way;
    out.velocity[i] = s_d * way;
    out.acceleration[i] = s_dd * way;
  }
  out.has_polar = false;
}

double largest_theta_rad(const ReferenceKind& kind) noexcept {
  return std::visit(Overloaded{[](const SetPointReference& r) { return largest_theta(r.u_rad); },
                               [](const PaperReference& r) { return r.theta_rad; },
                               [](const WayPointReference& r) {
                                 double theta = 0.0;
                                 for (const WayPoint& p : r.points) {
                                   theta = std::max(theta, largest_theta(p.u_rad));
                                 }
                                 return theta;
                               },
                               [](const LiveReference&) { return 0.0; },
                               [](const TipPathReference&) { return 0.0; }},
                    kind);
}

double largest_speed_radps(const ReferenceKind& kind) noexcept {
  return std::visit(
      Overloaded{
          [](const SetPointReference&) { return 0.0; },
          [](const PaperReference& r) {
            const double rise = r.rise_s > 0.0 ? 0.5 * pi * r.theta_rad / r.rise_s : 0.0;
            return std::hypot(rise, r.theta_rad * r.phi_amplitude_rad * r.rate_radps);
          },
          [](const WayPointReference& r) {
            double speed = 0.0;
            for (std::size_t i = 1; i < r.points.size(); ++i) {
              const WayPoint &a = r.points[i - 1], &b = r.points[i];
              speed = std::max(speed, kQuinticPeakSpeed * largest_distance(a.u_rad, b.u_rad) /
                                          (b.time_s - a.time_s));
            }
            return speed;
          },
          [](const LiveReference&) { return 0.0; }, [](const TipPathReference&) { return 0.0; }},
      kind);
}

ReferenceError::ReferenceError(int phase, const std::string& place, std::string expected_text,
                               std::string got_text)
    : std::invalid_argument(fmt::format("reference[{}]{}: expected {}, got {}", phase, place,
                                        expected_text, got_text)),
      key(fmt::format("reference[{}]{}", phase, place)),
      expected(std::move(expected_text)),
      got(std::move(got_text)) {}

void check_phase(int phase, const ReferenceKind& kind, const ControllerSettings& control,
                 int segments) {
  const Place place{phase};
  std::visit([&](const auto& r) { check(place, r, control, segments); }, kind);
  const double speed = largest_speed_radps(kind);
  place.require(
      speed <= control.max_speed_radps,
      fmt::format("speeds within control.max_speed_radps ({} rad/s)", control.max_speed_radps),
      fmt::format("up to {:.4g} rad/s; give it more time", speed));
}

double largest_theta_rad(const ReferenceSettings& settings) noexcept {
  double theta = 0.0;
  for (const ReferencePhase& phase : settings.phases) {
    theta = std::max(theta, largest_theta_rad(phase.kind));
  }
  return theta;
}

}  // namespace softarm
