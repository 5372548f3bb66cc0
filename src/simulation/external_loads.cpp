#include "softarm/simulation/external_loads.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <string>

#include "softarm/simulation/settings.hpp"

namespace softarm {
namespace {

constexpr double kForever_s = std::numeric_limits<double>::infinity();

void require(bool holds, const std::string& key, const std::string& expected,
             const std::string& got) {
  if (!holds) {
    throw std::invalid_argument("plant." + key + ": expected " + expected + ", got " + got);
  }
}

ExternalLoads::Load checked(const ExternalLoad& load, int segments) {
  require(load.segment >= 0 && load.segment <= segments, "loads.segment",
          "1 to " + std::to_string(segments) + ", or 0 for the tip", std::to_string(load.segment));
  require(load.force_n.allFinite() && load.moment_nm.allFinite(), "loads",
          "a finite force and moment", "another");
  require(std::isfinite(load.start_s), "loads.start_s", "a finite time",
          std::to_string(load.start_s));
  require(std::isfinite(load.duration_s) && load.duration_s >= 0.0, "loads.duration_s",
          "a finite time >= 0", std::to_string(load.duration_s));
  require(load.duration_s > 0.0 || load.shape == LoadShape::constant, "loads.duration_s",
          "a time > 0 of a half sine", "0");
  return {.segment = (load.segment == 0 ? segments : load.segment) - 1,
          .force_n = load.force_n,
          .moment_nm = load.moment_nm,
          .shape = load.shape,
          .start_s = load.start_s,
          .end_s = load.duration_s > 0.0 ? load.start_s + load.duration_s : kForever_s,
          .on = false};
}

}  // namespace

ExternalLoads::ExternalLoads(const PlantSettings& settings)
    : motion_(settings.base_motion),
      base_moves_(motion_.amplitude_m != Eigen::Vector3d::Zero() && motion_.frequency_hz != 0.0) {
  for (const ExternalLoad& load : settings.loads) {
    loads_.push_back(checked(load, settings.arm.size()));
  }
  if (settings.tip_force_n != Eigen::Vector3d::Zero()) {
    loads_.push_back(checked({.segment = 0, .force_n = settings.tip_force_n, .start_s = 0.0},
                             settings.arm.size()));
  }
  require(motion_.amplitude_m.allFinite() && std::isfinite(motion_.frequency_hz) &&
              std::isfinite(motion_.phase_rad),
          "base_motion", "finite numbers", "others");
  enter(0.0);
}

double ExternalLoads::scale(const Load& load, double t_s) {
  if (load.shape == LoadShape::constant) return 1.0;
  return std::sin(std::numbers::pi * (t_s - load.start_s) / (load.end_s - load.start_s));
}

double ExternalLoads::until(double t_s) const {
  double next = kForever_s;
  for (const Load& load : loads_) {
    for (const double instant : {load.start_s, load.end_s}) {
      if (instant > t_s) next = std::min(next, instant);
    }
  }
  return next;
}

bool ExternalLoads::enter(double t_s) {
  any_on_ = false;
  bool switched = false;
  for (Load& load : loads_) {
    const bool on = load.start_s <= t_s && t_s < load.end_s;
    switched |= on != load.on;
    load.on = on;
    any_on_ |= on;
  }
  return switched;
}

Eigen::Vector3d ExternalLoads::base_displacement_m(double t_s) const {
  if (!base_moves_) return Eigen::Vector3d::Zero();
  const double rate = 2.0 * std::numbers::pi * motion_.frequency_hz;
  return std::sin(rate * t_s + motion_.phase_rad) * motion_.amplitude_m;
}

Eigen::Vector3d ExternalLoads::base_acceleration_mps2(double t_s) const {
  const double rate = 2.0 * std::numbers::pi * motion_.frequency_hz;
  return -rate * rate * base_displacement_m(t_s);
}

}  // namespace softarm
