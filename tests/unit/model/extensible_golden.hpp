// The golden cases of arms that stretch, and their tolerances. Rows of u and of e have different
// units, so every bound is scaled: s_i = sqrt(B_ii), S_i the largest s of the same kind.
#pragma once

#include "golden.hpp"

namespace softarm::golden {

inline const std::vector<Case>& extensible_cases() {
  static const std::vector<Case> all = read_cases(path("extensible.json"));
  return all;
}

/// Sizes that the bounds are made of, of one case and one mass model.
struct ExtensibleScale {
  Eigen::VectorXd s, S;  ///< 3n
  double rate = 0.0;     ///< largest of |u'|, |e'| / l
  double weight = 0.0;   ///< |g| sqrt(sum mu): |G_i| <= s_i weight

  ExtensibleScale(const Case& c, const Terms& expected)
      : s(expected.at("B").diagonal().cwiseSqrt()), S(s.size()) {
    double mass = 0.0;
    for (int i = 0; i < c.arm.size(); ++i) {
      const SegmentParameters& segment = c.arm.segments[static_cast<std::size_t>(i)];
      mass += segment.mass_kg;
      const Eigen::Vector3d v = c.qd.segment<3>(3 * i);
      rate = std::max({rate, std::abs(v.x()), std::abs(v.y()),
                       std::abs(v.z()) / (segment.length_m + c.q(3 * i + 2))});
    }
    weight = c.arm.gravity_mps2.norm() * std::sqrt(mass);
    for (Eigen::Index i = 0; i < s.size(); ++i) {
      S(i) = 0.0;
      for (Eigen::Index j = 0; j < s.size(); ++j) {
        if ((i % 3 == 2) == (j % 3 == 2)) S(i) = std::max(S(i), s(j));
      }
    }
  }

  /// Of row i of C b.
  Eigen::VectorXd coriolis(const Eigen::VectorXd& b) const {
    return S * (rate * S.dot(b.cwiseAbs()));
  }
};

/// Size of row i of (17): every term's.
inline Eigen::VectorXd size_of_tau(const Case& c, const Terms& expected,
                                   const ExtensibleScale& scale) {
  const auto magnitude = [](const Eigen::MatrixXd& m) { return Eigen::MatrixXd(m.cwiseAbs()); };
  const auto& in = c.control;
  const Eigen::MatrixXd position = in.at("qbar") - c.q, velocity = in.at("qbar_dot") - c.qd;
  return scale.s * scale.weight + scale.coriolis(in.at("qbar_dot")) +
         magnitude(expected.at("B")) * magnitude(in.at("qbar_ddot")) +
         magnitude(c.expected.at("K")) * magnitude(in.at("qbar")) +
         magnitude(c.expected.at("D")) * magnitude(in.at("qbar_dot")) +
         magnitude(in.at("KP").cwiseProduct(position)) +
         magnitude(in.at("KD").cwiseProduct(velocity));
}

/// Residual of row i of the equation of motion at `acceleration`, formed with the golden terms, over
/// its bound.
inline double residual_over_tolerance(const Case& c, const Terms& expected,
                                      const ExtensibleScale& scale,
                                      const Eigen::VectorXd& acceleration) {
  using Real = long double;
  const auto exact = [](const Eigen::MatrixXd& m) {
    return Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic>(m.cast<Real>());
  };
  const auto J_transposed = exact(c.expected.at("J_tip").transpose());
  const auto left = exact(expected.at("B")) * exact(acceleration) + exact(expected.at("Cqd")) +
                    exact(c.expected.at("D")) * exact(c.qd) + exact(expected.at("G")) +
                    exact(c.expected.at("K")) * exact(c.q);
  const auto right = exact(c.expected.at("A_chamber")) * exact(c.forward.at("tau_A")) +
                     J_transposed * exact(c.forward.at("f_tip"));
  const Eigen::MatrixXd error = (left - right).cwiseAbs().cast<double>();
  const auto magnitude = [](const Eigen::MatrixXd& m) { return Eigen::MatrixXd(m.cwiseAbs()); };
  const Eigen::VectorXd size =
      scale.s * (scale.s.dot(acceleration.cwiseAbs()) + scale.weight) + scale.coriolis(c.qd) +
      magnitude(c.expected.at("A_chamber")) * magnitude(c.forward.at("tau_A")) +
      magnitude(c.expected.at("J_tip")).transpose() * magnitude(c.forward.at("f_tip")) +
      magnitude(c.expected.at("D")) * magnitude(c.qd) +
      magnitude(c.expected.at("K")) * magnitude(c.q);
  return (error.col(0).array() / (1e-12 * size.array())).maxCoeff();
}

/// Largest error over tolerance of one term: at most 1 is a pass.
/// @param expected the terms of the mass model.
inline double extensible_error_over_tolerance(const Case& c, const Terms& expected,
                                              const std::string& key, const Eigen::MatrixXd& want,
                                              const Eigen::MatrixXd& got) {
  if (got.rows() != want.rows() || got.cols() != want.cols() || !got.allFinite()) return INFINITY;
  const ExtensibleScale scale(c, expected);
  const Eigen::MatrixXd error = (got - want).cwiseAbs();
  const auto worst = [&error](const Eigen::MatrixXd& bound) {
    return (error.array() / bound.array()).maxCoeff();
  };
  if (key == "B") return worst(1e-12 * scale.s * scale.s.transpose());
  if (key == "C")
    return worst(1e-12 * scale.rate * scale.S * scale.S.transpose() +
                 Eigen::MatrixXd::Constant(error.rows(), error.cols(), 1e-300));
  if (key == "Cqd") return worst((1e-12 * scale.coriolis(c.qd)).array() + 1e-300);
  if (key == "G") return worst(1e-12 * scale.s * scale.weight);
  if (key == "kinetic_energy") return error(0) / (1e-12 * want(0) + 1e-300);
  if (key == "gravity_potential") {
    double size = 0.0;
    for (int i = 0; i < c.arm.size(); ++i) {
      size += c.arm.segments[static_cast<std::size_t>(i)].mass_kg * c.arm.gravity_mps2.norm() *
              c.expected.at("com_world").row(i).norm();
    }
    return error(0) / (1e-12 * size);
  }
  if (key.starts_with("tau")) {
    Eigen::VectorXd size = size_of_tau(c, expected, scale);
    if (key == "tau_A_chamber") {  // [u_x, u_y, N] from [u_y, u_x, e]
      for (Eigen::Index i = 0; i < size.size(); i += 3) std::swap(size(i), size(i + 1));
    }
    return worst(1e-12 * size);
  }
  if (key == "qdd_chamber") {
    const double condition = std::max(expected.at("cond_B_scaled")(0), 1e3);
    const double all = error.cwiseProduct(scale.s).maxCoeff() /
                       (1e-14 * condition * want.cwiseAbs().cwiseProduct(scale.s).maxCoeff());
    return std::max(all, residual_over_tolerance(c, expected, scale, got));
  }
  if (key == "Jdot_tip")
    return error.maxCoeff() / (1e-13 * std::max(1.0, c.qd.cwiseAbs().maxCoeff()));
  if (key == "K" || key == "D") {
    return (error.array() / (1e-13 * want.array().abs() + 1e-300)).maxCoeff();
  }
  if (key == "generalized_force") {
    Eigen::Index first = 0;
    double ratio = 0.0;
    for (int i = 0; i < c.arm.size(); ++i) {
      const ChamberGeometry& chambers = c.chambers[static_cast<std::size_t>(i)];
      const auto count = static_cast<Eigen::Index>(chambers.angles_rad.size());
      const double push = chambers.area_n_per_bar *
                          c.chamber.at("pressure").middleRows(first, count).cwiseAbs().sum();
      // The moments are smaller by r, which the bound for forces would hide.
      ratio =
          std::max({ratio, error(3 * i + 2) / (1e-13 * push),
                    error.middleRows<2>(3 * i).maxCoeff() / (1e-13 * push * chambers.offset_m)});
      first += count;
    }
    return ratio;
  }
  return error.maxCoeff() / 1e-13;  // T, com, J_tip, Jw_tip, A, lengths
}

}  // namespace softarm::golden
