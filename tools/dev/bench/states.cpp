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

}  // namespace

BenchInputs bench_inputs(int segments) {
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
  return inputs;
}

}  // namespace softarm
