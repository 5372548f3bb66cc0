// Leads the end of an arm's first segment in a slow circle, by references sent over LCM, and prints
// how well it follows. Needs a softarmd whose reference is `live`:
//
//   follow_reference config/one_segment_live.yaml
#include <cmath>
#include <complex>
#include <cstdio>
#include <exception>
#include <softarm/client/arm_client.hpp>

using namespace softarm;
using namespace std::complex_literals;

constexpr double kBend_rad = 0.3, kTurn_radps = 2.0, kPeriod_s = 0.01, kDuration_s = 8.0;

int main(int argc, char** argv) try {
  if (argc != 2) return std::fprintf(stderr, "usage: %s EXPERIMENT.yaml\n", argv[0]), 64;
  ArmClient arm(argv[1]);
  arm.request(OperatorRequest::arm);
  if (!arm.wait_for([&] { return arm.status() && arm.status()->mode == Mode::active; }, 10.0))
    return std::fprintf(stderr, "not ACTIVE: %s\n", arm.daemon_text().c_str()), 1;

  double squares = 0.0, bend_rad = 0.0;
  int count = 0;
  arm.on_status([&](const ArmStatus& status) {
    if (status.mode != Mode::active) return;
    squares += (status.reference_u_rad - status.u_rad).squaredNorm();
    bend_rad = std::fmax(bend_rad, status.theta_rad[0]);
    ++count;
  });
  const std::int64_t start_ns = arm.now_ns();
  SegmentVector u = SegmentVector::Zero(arm.experiment().arm.dof()), v = u, a = u;
  for (double t_s = 0.0; t_s < kDuration_s; t_s = to_seconds(arm.now_ns() - start_ns)) {
    // u = theta e^(i phi) with two derivatives: theta rises within 2 s, phi turns steadily.
    const double s = std::fmin(t_s / 2.0, 1.0), left = 1.0 - s;
    const double theta = kBend_rad * s * s * s * (10.0 - 15.0 * s + 6.0 * s * s);
    const double rate = kBend_rad * 15.0 * s * s * left * left;
    const double growth = kBend_rad * 15.0 * s * left * (1.0 - 2.0 * s);
    const std::complex<double> w = 1i * kTurn_radps, turn = std::exp(w * t_s);
    const auto set = [](SegmentVector& of_arm, std::complex<double> of_segment) {
      of_arm.head<2>() << of_segment.real(), of_segment.imag();
    };
    set(u, theta * turn);
    set(v, (rate + w * theta) * turn);
    set(a, (growth + 2.0 * w * rate + w * w * theta) * turn);
    arm.send_reference(u, v, a);
    arm.wait_for([] { return false; }, kPeriod_s);
  }
  std::printf("largest bend %.3f rad, reference minus estimate %.2f mrad rms\n", bend_rad,
              1e3 * std::sqrt(squares / std::fmax(1, count)));
} catch (const std::exception& error) {
  return std::fprintf(stderr, "%s\n", error.what()), 1;
}
