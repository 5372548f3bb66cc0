#include "dev/bench/methods.hpp"

#include <stdexcept>

#include "dev/bench/kdl_chain.hpp"
#include "softarm/control/curvature_controller.hpp"
#include "softarm/model/augmented_robot.hpp"
#include "softarm/model/dynamics.hpp"

namespace softarm {
namespace {

/// Beyond this KDL's O(n^2) matrices take a tenth of a second a call and add no information.
constexpr int kKdlMatricesUpTo = 50;

class Augmented : public Evaluator {
 public:
  explicit Augmented(const ArmParameters& arm) : robot_(arm) {}

  void evaluate(const BenchState& s) override { robot_.update(s.q, s.q_velocity); }
  MethodResult result() const override { return {robot_.B(), robot_.C(), robot_.G()}; }

 private:
  AugmentedRobot robot_;
};

class Matrices : public Evaluator {
 public:
  Matrices(const ArmParameters& arm, bool polar) : arm_(arm), workspace_(arm), polar_(polar) {
    result_.B.resize(arm.dof(), arm.dof());
    result_.C.resize(arm.dof(), arm.dof());
    result_.G.resize(arm.dof());
  }

  void evaluate(const BenchState& s) override {
    if (!polar_) {
      return dynamics_matrices(arm_, workspace_, s.u, s.velocity, result_.B, result_.C, result_.G);
    }
    polar_dynamics_matrices(arm_, workspace_, s.q, s.q_velocity, result_.B, result_.C, result_.G);
  }

 private:
  ArmParameters arm_;
  DynamicsWorkspace workspace_;
  bool polar_;
};

class Recursion : public Evaluator {
 public:
  explicit Recursion(const ArmParameters& arm) : arm_(arm), workspace_(arm) {
    result_.G.resize(arm.dof());
  }

  void evaluate(const BenchState& s) override {
    const ReferenceSample& r = s.reference.now;
    inverse_dynamics(arm_, workspace_, s.u, s.velocity, r.velocity, r.acceleration, {}, result_.G);
  }

 private:
  ArmParameters arm_;
  DynamicsWorkspace workspace_;
};

class Controller : public Evaluator {
 public:
  Controller(const ArmParameters& arm, const ControllerSettings& settings)
      : controller_(arm, settings) {}

  void evaluate(const BenchState& s) override {
    controller_.compute(s.u, s.velocity, s.reference, output_);
  }
  MethodResult result() const override { return {.B = {}, .C = {}, .G = output_.tau_u_nm}; }

 private:
  CurvatureController controller_;
  ControlOutput output_;
};

class Kdl : public Evaluator {
 public:
  Kdl(const ArmParameters& arm, Route route) : chain_(arm), route_(route) {
    result_.B.resize(arm.dof(), arm.dof());
    coriolis_.resize(arm.dof());
    result_.G.resize(arm.dof());
  }

  void evaluate(const BenchState& s) override {
    if (route_ == Route::kdl_maps) return chain_.maps(s.q, s.q_velocity);
    if (route_ == Route::kdl_inverse_dynamics) {
      return chain_.inverse_dynamics(s.q, s.q_velocity, s.q_acceleration, result_.G);
    }
    chain_.matrices(s.q, s.q_velocity, result_.B, coriolis_, result_.G);
  }
  MethodResult result() const override { return {.B = result_.B, .C = coriolis_, .G = result_.G}; }

 private:
  KdlChain chain_;
  Route route_;
  Eigen::VectorXd coriolis_;
};

}  // namespace

const char* name(Route route) noexcept {
  constexpr const char* kNames[] = {
      "augmented B, C, G",      "direct B, C, G", "direct B x + C y + G", "controller (17)",
      "maps (6), (11) for KDL", "KDL B, C q', G", "KDL B q'' + C q' + G"};
  return kNames[static_cast<std::size_t>(route)];
}

const char* coordinates(const Method& method) noexcept {
  return method.extensible ? "ue" : method.polar ? "polar" : "u";
}

const char* name(MassModel mass) noexcept {
  return mass == MassModel::point ? "point" : "distributed";
}

std::vector<Method> bench_methods(int segments) {
  std::vector<Method> methods = {{Route::augmented, true, MassModel::point}};
  for (const MassModel mass : {MassModel::point, MassModel::distributed}) {
    methods.push_back({Route::matrices, false, mass});
    methods.push_back({Route::matrices, true, mass});
    methods.push_back({Route::recursion, false, mass});
    methods.push_back({Route::controller, false, mass});
    methods.push_back({Route::controller, true, mass});
  }
  if (KdlChain::available()) {
    if (segments <= kKdlMatricesUpTo) methods.push_back({Route::kdl_matrices, true});
    methods.push_back({Route::kdl_inverse_dynamics, true});
    methods.push_back({Route::kdl_maps, true});
  }
  return methods;
}

ControllerSettings bench_controller(const Method& method, int segments) {
  ControllerSettings settings;
  settings.coordinates = method.polar ? ControlCoordinates::polar : ControlCoordinates::u;
  settings.kp.assign(static_cast<std::size_t>(2 * segments), 1.0);
  settings.kd.assign(static_cast<std::size_t>(2 * segments), 0.002);
  return settings;
}

std::unique_ptr<Evaluator> make_evaluator(const Method& method, ArmParameters arm,
                                          const ControllerSettings& settings) {
  arm.mass = method.mass;
  arm.extensible = method.extensible;
  switch (method.route) {
    case Route::augmented:
      return std::make_unique<Augmented>(arm);
    case Route::matrices:
      return std::make_unique<Matrices>(arm, method.polar);
    case Route::recursion:
      return std::make_unique<Recursion>(arm);
    case Route::controller:
      return std::make_unique<Controller>(arm, settings);
    case Route::kdl_maps:
    case Route::kdl_matrices:
    case Route::kdl_inverse_dynamics:
      return std::make_unique<Kdl>(arm, method.route);
  }
  throw std::invalid_argument("expected a route of this build, got another");
}

}  // namespace softarm
