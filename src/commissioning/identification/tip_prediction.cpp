#include "softarm/commissioning/identification/tip_prediction.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "softarm/model/segment.hpp"

namespace softarm {

ChordMap ChordMap::identity(Eigen::Index segments) {
  ChordMap out;
  out.of_bend.setZero(2 * segments, 3);
  for (Eigen::Index c = 0; c < 2 * segments; ++c) out.of_bend(c, c % 2) = 1.0;
  return out;
}

Eigen::MatrixXd ChordMap::bend_rad(const Eigen::MatrixXd& u_rad) const {
  Eigen::MatrixXd out(u_rad.rows(), u_rad.cols());
  for (Eigen::Index c = 0; c < u_rad.cols(); ++c)
    out.col(c) = u_rad.middleCols<2>(c - c % 2) * of_bend.row(c).head<2>().transpose() +
                 Eigen::VectorXd::Constant(u_rad.rows(), of_bend(c, 2));
  return out;
}

Eigen::MatrixXd chord_bends_rad(const Eigen::MatrixXd& chord_m) {
  Eigen::MatrixXd out(chord_m.rows(), chord_m.cols() / 3 * 2);
  for (Eigen::Index k = 0; k < chord_m.rows(); ++k)
    for (Eigen::Index i = 0; i < chord_m.cols() / 3; ++i) {
      const Eigen::Vector3d t = chord_m.row(k).segment<3>(3 * i);
      const double across = std::hypot(t.x(), t.y());
      out.row(k).segment<2>(2 * i) = across > 0.0
                                         ? Eigen::RowVector2d(2.0 * std::atan2(across, t.z()) /
                                                              across * t.head<2>().transpose())
                                         : Eigen::RowVector2d::Zero();
    }
  return out;
}

ChordMap fit_chords(std::span<const MotionRecord> records) {
  const Eigen::Index dof = records.front().u_rad.cols();
  ChordMap out = ChordMap::identity(dof / 2);
  for (Eigen::Index c = 0; c < dof; ++c) {
    Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
    Eigen::Vector3d right = Eigen::Vector3d::Zero();
    const Eigen::Vector3d prior = out.of_bend.row(c);
    for (const MotionRecord& record : records) {
      const Eigen::MatrixXd bends = chord_bends_rad(record.chord_m);
      for (Eigen::Index k = 0; k < record.time_s.size(); ++k) {
        if (record.time_s[k] < record.scored_from_s) continue;
        const Eigen::Vector3d row(record.u_rad(k, c - c % 2), record.u_rad(k, c - c % 2 + 1), 1.0);
        normal += row * row.transpose();
        right += row * (bends(k, c) - row.dot(prior));
      }
    }
    // What the motion does not show stays that of constant curvature.
    normal.diagonal().array() += 1e-3 * normal(2, 2) * 1e-2;
    out.of_bend.row(c) += normal.ldlt().solve(right).transpose();
  }
  return out;
}

Eigen::MatrixXd chords_m(const Eigen::MatrixXd& bend_rad, const Eigen::MatrixXd& length_m) {
  const Eigen::Index n = bend_rad.cols() / 2;
  Eigen::MatrixXd out(bend_rad.rows(), 3 * n);
  for (Eigen::Index k = 0; k < bend_rad.rows(); ++k)
    for (Eigen::Index i = 0; i < n; ++i)
      out.row(k).segment<3>(3 * i) =
          segment_tip(length_m(k, i), bend_rad.row(k).segment<2>(2 * i).transpose());
  return out;
}

Eigen::MatrixX3d tips_m(const Eigen::MatrixXd& u_rad, const Eigen::MatrixXd& chord_m) {
  Eigen::MatrixX3d out(u_rad.rows(), 3);
  for (Eigen::Index k = 0; k < u_rad.rows(); ++k) {
    Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
    Eigen::Vector3d tip = Eigen::Vector3d::Zero();
    for (Eigen::Index i = 0; i < u_rad.cols() / 2; ++i) {
      tip += R * chord_m.row(k).segment<3>(3 * i).transpose();
      R = R * segment_rotation(u_rad.row(k).segment<2>(2 * i).transpose());
    }
    out.row(k) = tip;
  }
  return out;
}

}  // namespace softarm
