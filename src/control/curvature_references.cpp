#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "control/blend.hpp"
#include "softarm/control/reference_kinds.hpp"
#include "softarm/control/settings.hpp"

namespace softarm {
namespace {

using std::numbers::pi;

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

void check_u(const ReferencePlace& place, const std::vector<double>& u_rad,
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

}  // namespace

void SetPointReference::describe(Keys& key) { describe_pose(key, u_rad, Presence::required); }

void SetPointReference::check(const ReferencePlace& place, const ControllerSettings& control,
                              int segments) const {
  check_u(place, u_rad, control, segments);
}

double SetPointReference::largest_theta_rad() const noexcept { return largest_theta(u_rad); }

void SetPointReference::evaluate(double, ReferenceSample& out) const noexcept {
  rest_at(u_rad, out);
}

void PaperReference::describe(Keys& key) {
  key("theta_rad", theta_rad, from(0, 2 * pi), "theta of every segment after the rise");
  key("rise_s", rise_s, above(0, 1e3), "time of the rise from theta = 0");
  key("phi_centre_rad", phi_centre_rad, from(-2 * pi, 2 * pi),
      "phi_i = centre + amplitude cos(rate t + (i - 1) step)");
  key("phi_amplitude_rad", phi_amplitude_rad, from(0, 2.0 * std::numbers::pi), "amplitude of phi");
  key("rate_radps", rate_radps, from(0, 1e3), "rate of phi");
  key("phase_step_rad", phase_step_rad, from(-2 * pi, 2 * pi), "phase from segment to segment");
}

void PaperReference::check(const ReferencePlace& place, const ControllerSettings& control,
                           int) const {
  place.require_finite(
      {theta_rad, rise_s, phi_centre_rad, phi_amplitude_rad, rate_radps, phase_step_rad});
  place.require(theta_rad >= 0.0 && rise_s >= 0.0, "theta (rad) and rise time (s) >= 0",
                fmt::format("{} and {}", theta_rad, rise_s));
  ReferencePlace{place.phase, ".theta_rad"}.require(
      theta_rad <= control.max_theta_rad,
      fmt::format("at most control.max_theta_rad ({} rad)", control.max_theta_rad),
      fmt::format("{} rad", theta_rad));
}

double PaperReference::largest_speed_radps() const noexcept {
  const double rise = rise_s > 0.0 ? 0.5 * pi * theta_rad / rise_s : 0.0;
  return std::hypot(rise, theta_rad * phi_amplitude_rad * rate_radps);
}

double PaperReference::period_s() const noexcept {
  return rate_radps > 0.0 && phi_amplitude_rad > 0.0 ? 2.0 * pi / rate_radps : 0.0;
}

// (24) in polar coordinates, then u = theta n, u' = theta' n + theta phi' t,
// u'' = (theta'' - theta phi'^2) n + (2 theta' phi' + theta phi'') t with n = (cos, sin) phi, t =
// (-sin, cos) phi.
void PaperReference::evaluate(double time_s, ReferenceSample& out) const noexcept {
  double theta = theta_rad, theta_d = 0.0, theta_dd = 0.0;
  if (time_s < rise_s) {
    const double rate = pi / rise_s, angle = rate * time_s;
    // theta (1 - cos) / 2 without cancellation near the start.
    theta = theta_rad * std::pow(std::sin(0.5 * angle), 2);
    theta_d = 0.5 * theta_rad * rate * std::sin(angle);
    theta_dd = 0.5 * theta_rad * rate * rate * std::cos(angle);
  }
  const Eigen::Index n = out.u.size() / 2;
  out.has_polar = true;
  out.polar.resize(2 * n);
  out.polar_velocity.resize(2 * n);
  out.polar_acceleration.resize(2 * n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const double rate = rate_radps, amplitude = phi_amplitude_rad;
    const double angle = rate * time_s + static_cast<double>(i) * phase_step_rad;
    const double phi = phi_centre_rad + amplitude * std::cos(angle);
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

void WayPointReference::describe(Keys& key) {
  key("repeat", repeat,
      "start again after the last point, which then equals the first; left out: false");
  const Key list = {"points", "at rest in each, minimum jerk between them", Presence::required};
  key.list(list, points, [&](WayPoint& point) {
    key("time_s", point.time_s, from(0, 1e6), "since the phase began, increasing",
        Presence::required);
    describe_pose(key, point.u_rad, Presence::required);
  });
}

void WayPointReference::check(const ReferencePlace& place, const ControllerSettings& control,
                              int segments) const {
  place.require(!points.empty(), "at least one way point", "none");
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double time_s = points[i].time_s;
    const ReferencePlace point{place.phase, fmt::format(".points[{}]", i)};
    check_u(point, points[i].u_rad, control, segments);
    const ReferencePlace time{place.phase, point.at + ".time_s"};
    time.require_finite({time_s});
    time.require(time_s >= 0.0, "at least 0 s", fmt::format("{} s", time_s));
    time.require(i == 0 || time_s > points[i - 1].time_s, "later than the point before",
                 fmt::format("{} s", time_s));
  }
  if (!repeat) return;
  const ReferencePlace list{place.phase, ".points"};
  list.require(points.size() >= 2, "at least 2 points to repeat", fmt::format("{}", points.size()));
  const double apart = largest_distance(points.front().u_rad, points.back().u_rad);
  list.require(apart <= 1e-9, "the last way point to equal the first, since they repeat",
               fmt::format("one {:.3g} rad away", apart));
}

double WayPointReference::largest_theta_rad() const noexcept {
  double theta = 0.0;
  for (const WayPoint& point : points) theta = std::max(theta, largest_theta(point.u_rad));
  return theta;
}

double WayPointReference::largest_speed_radps() const noexcept {
  double speed = 0.0;
  for (std::size_t i = 1; i < points.size(); ++i) {
    const WayPoint &a = points[i - 1], &b = points[i];
    speed = std::max(
        speed, kQuinticPeakSpeed * largest_distance(a.u_rad, b.u_rad) / (b.time_s - a.time_s));
  }
  return speed;
}

double WayPointReference::period_s() const noexcept {
  return repeat ? points.back().time_s - points.front().time_s : 0.0;
}

void WayPointReference::evaluate(double time_s, ReferenceSample& out) const noexcept {
  const double first = points.front().time_s, last = points.back().time_s;
  double time = time_s;
  if (repeat && time > last) time = first + std::fmod(time - first, last - first);
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

void LiveReference::describe(Keys& key) {
  key("timeout_s", timeout_s, above(0, 1e3), "silence after which the last u is held at rest");
}

void LiveReference::check(const ReferencePlace& place, const ControllerSettings&, int) const {
  place.require(std::isfinite(timeout_s) && timeout_s >= 0.0, "a timeout (s) >= 0",
                fmt::format("{}", timeout_s));
}

void LiveTipReference::describe(Keys& key) {
  key("timeout_s", timeout_s, above(0, 1e3),
      "silence after which a target that moves stops; one at rest needs no repetition");
  key("max_speed_mps", max_speed_mps, above(0, 100), "of the target on its way to a new one");
  key("max_acceleration_mps2", max_acceleration_mps2, above(0, 1e4), "the same");
}

void LiveTipReference::check(const ReferencePlace& place, const ControllerSettings&, int) const {
  place.require_finite({timeout_s, max_speed_mps, max_acceleration_mps2});
}

}  // namespace softarm
