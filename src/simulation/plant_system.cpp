#include "softarm/simulation/plant_system.hpp"

#include <Eigen/Cholesky>
#include <stdexcept>
#include <string>

#include "softarm/model/segment.hpp"
#include "softarm/simulation/settings.hpp"

namespace softarm {
namespace {

// Central differences: step^2 and round-off / step balance near the cube root of the round-off.
constexpr double kStep = 1e-5;

/// Half the difference of `function` at x + step e_j and x - step e_j, over the step, for every j.
template <class Function>
void differences(const Eigen::VectorXd& x, double step, const Function& function,
                 SecondOrderSystem::Matrix out) {
  Eigen::VectorXd at = x, above(x.size()), below(x.size());
  for (Eigen::Index j = 0; j < x.size(); ++j) {
    at[j] = x[j] + step;
    function(at, above);
    at[j] = x[j] - step;
    function(at, below);
    at[j] = x[j];
    out.col(j) = (above - below) / (2.0 * step);
  }
}

}  // namespace

PlantSystem::PlantSystem(const PlantSettings& settings, bool stretches, bool bends_otherwise)
    : input_(settings.arm.dof()), external_loads_(settings), segments_arm_(settings.arm) {
  if (settings.arm.extensible && !stretches) {
    throw std::invalid_argument(std::string("plant.arm.extensible: expected false for kind ") +
                                settings.kind.name() + ", got true");
  }
  if (settings.material.bends_otherwise() && !bends_otherwise) {
    throw std::invalid_argument(
        std::string("plant.material: expected nothing but hysteresis for kind ") +
        settings.kind.name() + ", got cubic, stiffening, remanence or bouc_wen");
  }
}

bool PlantSystem::acceleration(double t_s, ConstVector x, ConstVector v, Vector a) {
  const Eigen::VectorXd zero = Eigen::VectorXd::Zero(size());
  Eigen::MatrixXd inertia(size(), size());
  differences(
      zero, 1.0, [&](const auto& at, auto& out) { residual(t_s, x, v, at, out); }, inertia);
  Eigen::VectorXd bias(size());
  residual(t_s, x, v, zero, bias);
  const Eigen::LDLT<Eigen::MatrixXd> factors(inertia);
  if (factors.info() != Eigen::Success || !factors.isPositive()) return false;
  a = -factors.solve(bias);
  return a.allFinite();
}

void PlantSystem::linearize(double t_s, ConstVector x, ConstVector v, ConstVector a, Matrix by_a,
                            Matrix by_v, Matrix by_x) {
  differences(
      a, 1.0, [&](const auto& at, auto& out) { residual(t_s, x, v, at, out); }, by_a);
  differences(
      v, kStep, [&](const auto& at, auto& out) { residual(t_s, x, at, a, out); }, by_v);
  differences(
      x, kStep, [&](const auto& at, auto& out) { residual(t_s, at, v, a, out); }, by_x);
}

double PlantSystem::kinetic_energy_j(ConstVector x, ConstVector v) {
  const Eigen::VectorXd zero = Eigen::VectorXd::Zero(size());
  Eigen::VectorXd with(size()), without(size());
  residual(0.0, x, zero, v, with);
  residual(0.0, x, zero, zero, without);
  return 0.5 * v.dot(with - without);  // r is linear in x'': the difference is B v
}

void PlantSystem::curvature(ConstVector x, ConstVector v, Vector u, Vector rate) const {
  const auto n = static_cast<std::size_t>(segments_arm_.size());
  std::vector<Eigen::Isometry3d> now(n), later(n), earlier(n);
  segment_ends(x, now);
  segment_ends(x + kStep * v, later);
  segment_ends(x - kStep * v, earlier);
  Eigen::Isometry3d start = Eigen::Isometry3d::Identity();
  start.linear() = segments_arm_.base_rotation;
  start.translation() = segments_arm_.base_position_m;
  Eigen::Isometry3d start_later = start, start_earlier = start;
  for (std::size_t i = 0; i < n; ++i) {
    const Eigen::Isometry3d end = start.inverse() * now[i];
    const Eigen::Matrix3d turn = (start_later.inverse() * later[i]).linear() *
                                 (start_earlier.inverse() * earlier[i]).linear().transpose();
    const Eigen::AngleAxisd turned(turn);
    Eigen::Vector2d bend, bend_rate;
    fit_segment(end.linear(), end.translation(), turned.angle() / (2.0 * kStep) * turned.axis(),
                bend, bend_rate);
    u.segment<2>(static_cast<Eigen::Index>(2 * i)) = bend;
    rate.segment<2>(static_cast<Eigen::Index>(2 * i)) = bend_rate;
    start = now[i];
    start_later = later[i];
    start_earlier = earlier[i];
  }
}

SegmentScalars PlantSystem::elongation_m(ConstVector x) const {
  SegmentScalars out;
  if (!segments_arm_.extensible) return out;
  const Eigen::Index n = segments_arm_.size(), parts = x.size() / (3 * n);
  out.setZero(n);
  for (Eigen::Index j = 0; j < n * parts; ++j) out[j / parts] += x[3 * j + 2];
  return out;
}

PlantShape PlantSystem::shape(ConstVector x) const {
  Eigen::VectorXd u(segments_arm_.dof()), rate(segments_arm_.dof());
  curvature(x, Eigen::VectorXd::Zero(x.size()), u, rate);
  return arcs(segments_arm_, u);
}

PlantShape PlantSystem::arcs(const ArmParameters& arm, ConstVector u) {
  constexpr int kPointsOfAnArc = 6;
  Eigen::Isometry3d frame = Eigen::Isometry3d::Identity();
  frame.linear() = arm.base_rotation;
  frame.translation() = arm.base_position_m;
  PlantShape shape{.bend_rad = Eigen::VectorXd(2 * arm.size()), .points_m = {frame.translation()}};
  const int width = arm.segment_dof();
  for (int i = 0; i < arm.size(); ++i) {
    const double elongation_m = arm.extensible ? u[width * i + 2] : 0.0;
    const double length_m = arm.segments[static_cast<std::size_t>(i)].length_m + elongation_m;
    const Eigen::Vector2d bend = u.segment<2>(width * i);
    shape.bend_rad.segment<2>(2 * i) = bend;
    for (int k = 1; k <= kPointsOfAnArc; ++k)
      shape.points_m.emplace_back(frame *
                                  segment_point(length_m, bend, double(k) / kPointsOfAnArc));
    frame.translate(segment_tip(length_m, bend));
    frame.rotate(segment_rotation(bend));
  }
  return shape;
}

}  // namespace softarm
