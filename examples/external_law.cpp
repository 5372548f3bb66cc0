// A control law of one's own in a separate process: softarmd keeps safety, frames and limits, and
// asks it every tick for a generalized force. Here: what holds the reference's shape at rest, and a
// spring and a damper towards it. Needs a softarmd with `control: {law: external}`:
//
//   external_law config/external_law.yaml
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <softarm/client/arm_client.hpp>
#include <softarm/model/statics.hpp>

using namespace softarm;

constexpr double kStiffness_nm_per_rad = 0.6, kDamping_nms_per_rad = 0.01;

int main(int argc, char** argv) try {
  if (argc < 2)
    return std::fprintf(stderr, "usage: %s EXPERIMENT.yaml [SECONDS [VALIDITY_S]]\n", argv[0]), 64;
  const double duration_s = argc > 2 ? std::atof(argv[2]) : 10.0;
  const double validity_s = argc > 3 ? std::atof(argv[3]) : 0.05;
  ArmClient arm(argv[1]);
  const ArmParameters& model = arm.experiment().arm;
  DynamicsWorkspace workspace(model);
  SegmentVector force_nm = SegmentVector::Zero(model.dof());
  double squares = 0.0, trip_s = 0.0;
  int active = 0;
  arm.on_law_request([&](const LawRequest& state) {
    const SegmentVector error_rad = state.reference_u_rad - state.u_rad;
    static_moments(model, workspace, state.reference_u_rad, force_nm);
    force_nm += kStiffness_nm_per_rad * error_rad +
                kDamping_nms_per_rad * (state.reference_velocity_radps - state.velocity_radps);
    arm.answer_force(state, force_nm, validity_s);
    if (state.mode != Mode::active || state.active_s < 2.0) return;
    squares += error_rad.squaredNorm() / static_cast<double>(model.dof());
    ++active;
  });
  arm.on_status([&](const ArmStatus& status) { trip_s = status.law_round_trip_s; });
  arm.wait_for([&] { return arm.status() && arm.status()->mode == Mode::active; }, 10.0);
  arm.wait_for([] { return false; }, duration_s);
  std::printf("%d answers while ACTIVE, error of u %.2f mrad rms, newest round trip %.2f ms\n",
              active, 1e3 * std::sqrt(squares / std::fmax(1, active)), 1e3 * trip_s);
} catch (const std::exception& error) {
  return std::fprintf(stderr, "%s\n", error.what()), 1;
}
