#include "dev/bench/states.hpp"

#include <algorithm>
#include <cmath>
#include <random>

#include "softarm/model/polar.hpp"

namespace softarm {
namespace {

class Draw {
 public:
  explicit Draw(unsigned seed) : engine_(seed) {}

  Eigen::VectorXd vector(int segments, double bound) {
    Eigen::VectorXd result(2 * segments);
    for (double& x : result) x = uniform(-bound, bound);
    return result;
  }
  Eigen::VectorXd configuration(int segments) {
    Eigen::VectorXd q(2 * segments);
    for (int i = 0; i < segments; ++i) q.segment<2>(2 * i) << uniform(-3.1, 3.1), uniform(0.1, 1.5);
    return q;
  }

 private:
  double uniform(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(engine_);
  }

  std::mt19937 engine_;
};

ReferenceSample reference_sample(Draw& draw, int segments) {
  ReferenceSample r;
  r.has_polar = true;
  r.polar = draw.configuration(segments);
  r.polar_velocity = draw.vector(segments, 2.0);
  r.polar_acceleration = draw.vector(segments, 5.0);
  for (SegmentVector* v : {&r.u, &r.velocity, &r.acceleration}) v->resize(2 * segments);
  polar_to_u(r.polar, r.u);
  polar_velocity_to_u(r.polar, r.polar_velocity, r.velocity);
  polar_acceleration_to_u(r.polar, r.polar_velocity, r.polar_acceleration, r.acceleration);
  return r;
}

/// [u_x, u_y] to [u_x, u_y, e] of every segment.
void add_elongations(BenchInputs& inputs) {
  inputs.arm.extensible = true;
  std::mt19937 engine(1);
  const auto add = [&engine](auto& v, double bound) {
    std::uniform_real_distribution<double> elongation(-bound, bound);
    const Eigen::VectorXd u = v;
    v.resize(u.size() / 2 * 3);
    for (Eigen::Index i = 0; i < u.size() / 2; ++i) {
      v.template segment<3>(3 * i) << u(2 * i), u(2 * i + 1), elongation(engine);
    }
  };
  constexpr double kElongation = 0.03, kSpeed = 0.1, kAcceleration = 1.0;
  for (BenchState& s : inputs.states) {
    ReferenceSample& r = s.reference.now;
    add(s.u, kElongation);
    add(r.u, kElongation);
    add(s.velocity, kSpeed);
    add(r.velocity, kSpeed);
    add(s.acceleration, kAcceleration);
    add(r.acceleration, kAcceleration);
  }
}

}  // namespace

BenchInputs bench_inputs(int segments, bool extensible) {
  constexpr unsigned kSeed = 20190414;
  Draw draw(kSeed + static_cast<unsigned>(segments));
  BenchInputs inputs;
  inputs.arm.segments.resize(static_cast<std::size_t>(segments));
  inputs.states.resize(static_cast<std::size_t>(std::clamp(320 / segments, 8, 64)));
  for (BenchState& s : inputs.states) {
    s.q = draw.configuration(segments);
    s.q_velocity = draw.vector(segments, 2.0);
    s.q_acceleration = draw.vector(segments, 5.0);
    s.u = s.velocity = s.acceleration = Eigen::VectorXd(2 * segments);
    polar_to_u(s.q, s.u);
    polar_velocity_to_u(s.q, s.q_velocity, s.velocity);
    polar_acceleration_to_u(s.q, s.q_velocity, s.q_acceleration, s.acceleration);
    s.reference.now = reference_sample(draw, segments);
  }
  if (extensible) add_elongations(inputs);
  return inputs;
}

}  // namespace softarm
