// Orocos KDL on the chain of Table I. The constraint m(q) is written out here on its own, by
// spherical Bessel functions of theta / 2, so that the chain is also an independent route to B, C
// q' and G. It divides by theta: for comparison between 0.05 and 2 pi, not for use.
#include "dev/bench/kdl_plugin.hpp"

#include <Eigen/Core>
#include <cmath>
#include <kdl/chain.hpp>
#include <kdl/chaindynparam.hpp>
#include <kdl/chainidsolver_recursive_newton_euler.hpp>
#include <numbers>
#include <vector>

namespace softarm {
namespace {

constexpr int kJoints = 10;
using Block = Eigen::Matrix<double, kJoints, 2>;
using Joints = Eigen::Matrix<double, kJoints, 1>;

/// A function of theta and its first two derivatives.
struct Derivatives {
  double value, first, second;
};

/// b and eta of (6): b [cos eta, sin eta] = L/2 [j0(y), j1(y)], y = theta / 2.
void bend(double length, double theta, Derivatives& b, Derivatives& eta) {
  const double y = 0.5 * theta, s = std::sin(y), c = std::cos(y);
  const double j0 = s / y, j1 = (j0 - c) / y;
  const double r2 = j0 * j0 + j1 * j1, r = std::sqrt(r2), p = j0 * j1, q = j1 * j1;
  const double r_y = -2.0 * q / (y * r);
  const double r_yy =
      -2.0 * (2.0 * p / (y * r) - 5.0 * q / (y * y * r) + 2.0 * q * q / (y * y * r2 * r));
  const double eta_y = 1.0 - 2.0 * p / (y * r2);
  const double eta_yy =
      -2.0 * ((j0 * j0 - q) / (y * r2) - 3.0 * p / (y * y * r2) + 4.0 * p * q / (y * y * r2 * r2));
  b = {0.5 * length * r, 0.25 * length * r_y, 0.125 * length * r_yy};
  eta = {std::atan2(j1, j0), 0.5 * eta_y, 0.25 * eta_yy};
}

KDL::Chain table_one(int segments, const double* mass) {
  using KDL::Joint;
  constexpr double kQuarter = std::numbers::pi / 2.0;
  constexpr double kAlpha[kJoints] = {-kQuarter, kQuarter, -kQuarter, kQuarter, 0.0,
                                      -kQuarter, kQuarter, -kQuarter, kQuarter, 0.0};
  KDL::Chain chain;
  for (int i = 0; i < segments; ++i) {
    for (int joint = 0; joint < kJoints; ++joint) {
      const bool slides = joint == 2 || joint == 7;
      // The mass sits in the origin of the frame behind joint 5.
      const KDL::RigidBodyInertia body(joint == 4 ? mass[i] : 0.0, KDL::Vector::Zero(),
                                       KDL::RotationalInertia::Zero());
      chain.addSegment(KDL::Segment(Joint(slides ? Joint::TransZ : Joint::RotZ),
                                    KDL::Frame::DH(0.0, kAlpha[joint], 0.0, 0.0), body));
    }
  }
  return chain;
}

class TableOne {
 public:
  TableOne(int segments, const double* length, const double* mass, const double* gravity)
      : n_(segments),
        length_(length, length + segments),
        chain_(table_one(segments, mass)),
        dynamics_(chain_, {gravity[0], gravity[1], gravity[2]}),
        newton_euler_(chain_, {gravity[0], gravity[1], gravity[2]}),
        J_(static_cast<std::size_t>(segments)),
        no_forces_(chain_.getNrOfSegments(), KDL::Wrench::Zero()),
        xi_(joints()),
        velocity_(joints()),
        bias_(joints()),
        acceleration_(joints()),
        torque_(joints()),
        gravity_(joints()),
        B_(joints()) {}

  void maps(const double* q, const double* v) {
    for (int i = 0; i < n_; ++i) {
      const double phi = q[2 * i], theta = q[2 * i + 1], phi_d = v[2 * i], theta_d = v[2 * i + 1];
      Derivatives b, eta;
      bend(length_[static_cast<std::size_t>(i)], theta, b, eta);
      const double rest = 0.5 * theta - eta.value, rest_1 = 0.5 - eta.first;
      const double square = theta_d * theta_d;
      Joints xi, along, bias;
      xi << phi, rest, b.value, eta.value, -phi, phi, eta.value, b.value, rest, -phi;
      along << 0.0, rest_1, b.first, eta.first, 0.0, 0.0, eta.first, b.first, rest_1, 0.0;
      bias << 0.0, -eta.second, b.second, eta.second, 0.0, 0.0, eta.second, b.second, -eta.second,
          0.0;
      Block& J = J_[static_cast<std::size_t>(i)];
      J.col(0) << 1.0, 0.0, 0.0, 0.0, -1.0, 1.0, 0.0, 0.0, 0.0, -1.0;
      J.col(1) = along;
      at(xi_, i) = xi;
      at(velocity_, i) = phi_d * J.col(0) + theta_d * along;
      at(bias_, i) = square * bias;
    }
  }

  void matrices(const double* q, const double* v, double* B, double* C_velocity, double* G) {
    maps(q, v);
    dynamics_.JntToMass(xi_, B_);
    dynamics_.JntToCoriolis(xi_, velocity_, torque_);
    dynamics_.JntToGravity(xi_, gravity_);
    torque_.data.noalias() += B_.data * bias_.data;
    Eigen::Map<Eigen::MatrixXd> out(B, 2 * n_, 2 * n_);
    // J_m is block diagonal and B symmetric: only the blocks that are there, and one triangle.
    for (int j = 0; j < n_; ++j) {
      for (int i = 0; i <= j; ++i) {
        const Block columns = B_.data.block<kJoints, kJoints>(kJoints * i, kJoints * j)
                                  .lazyProduct(J_[static_cast<std::size_t>(j)]);
        const Eigen::Matrix2d block =
            J_[static_cast<std::size_t>(i)].transpose().lazyProduct(columns);
        out.block<2, 2>(2 * i, 2 * j) = block;
        out.block<2, 2>(2 * j, 2 * i) = block.transpose();
      }
    }
    project(torque_, C_velocity);
    project(gravity_, G);
  }

  void inverse_dynamics(const double* q, const double* v, const double* a, double* out) {
    maps(q, v);
    for (int i = 0; i < n_; ++i) {
      const Eigen::Map<const Eigen::Vector2d> own(a + 2 * i);
      at(acceleration_, i) = J_[static_cast<std::size_t>(i)] * own + at(bias_, i);
    }
    newton_euler_.CartToJnt(xi_, velocity_, acceleration_, no_forces_, torque_);
    project(torque_, out);
  }

 private:
  unsigned joints() const { return chain_.getNrOfJoints(); }
  static Eigen::VectorXd::FixedSegmentReturnType<kJoints>::Type at(KDL::JntArray& array, int i) {
    return array.data.segment<kJoints>(kJoints * i);
  }
  void project(KDL::JntArray& torque, double* out) {
    for (int i = 0; i < n_; ++i) {
      Eigen::Map<Eigen::Vector2d>(out + 2 * i) =
          J_[static_cast<std::size_t>(i)].transpose() * at(torque, i);
    }
  }

  int n_;
  std::vector<double> length_;
  KDL::Chain chain_;
  KDL::ChainDynParam dynamics_;
  KDL::ChainIdSolver_RNE newton_euler_;
  std::vector<Block> J_;
  KDL::Wrenches no_forces_;
  KDL::JntArray xi_, velocity_, bias_, acceleration_, torque_, gravity_;
  KDL::JntSpaceInertiaMatrix B_;
};

TableOne& chain_of(void* chain) { return *static_cast<TableOne*>(chain); }

constexpr KdlPlugin kPlugin{
    .make = [](int n, const double* length, const double* mass, const double* gravity) -> void* {
      return new TableOne(n, length, mass, gravity);
    },
    .destroy = [](void* chain) { delete static_cast<TableOne*>(chain); },
    .maps = [](void* chain, const double* q, const double* v) { chain_of(chain).maps(q, v); },
    .matrices = [](void* chain, const double* q, const double* v, double* B, double* Cv,
                   double* G) { chain_of(chain).matrices(q, v, B, Cv, G); },
    .inverse_dynamics = [](void* chain, const double* q, const double* v, const double* a,
                           double* out) { chain_of(chain).inverse_dynamics(q, v, a, out); }};

}  // namespace
}  // namespace softarm

extern "C" __attribute__((visibility("default")))
const softarm::KdlPlugin* const softarm_kdl_plugin = &softarm::kPlugin;
