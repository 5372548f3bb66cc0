// A motion-capture sender of your own: 200 frames a second of an arm that swings slowly, until
// interrupted. Put the poses that your cameras measure where `forward_kinematics` stands.
//
//   mocap_sender EXPERIMENT.yaml
#include <chrono>
#include <cmath>
#include <cstdio>
#include <lcm/lcm-cpp.hpp>
#include <softarm_messages/mocap_frame_t.hpp>
#include <thread>
#include <vector>

#include "softarm/config/load.hpp"
#include "softarm/model/kinematics.hpp"

int main(int argc, char** argv) try {
  if (argc != 2) return std::fprintf(stderr, "usage: mocap_sender EXPERIMENT.yaml\n"), 64;
  const softarm::Experiment experiment = softarm::load_experiment(argv[1]);
  const softarm::BodySettings& bodies = experiment.transport.bodies;
  lcm::LCM lcm(experiment.transport.lcm.url);
  if (!lcm.good()) return std::fprintf(stderr, "cannot open LCM\n"), 1;

  using std::chrono::steady_clock;
  const auto start = steady_clock::now();
  softarm_messages::mocap_frame_t frame{};
  for (;; ++frame.frame_number) {
    const auto capture = start + frame.frame_number * std::chrono::milliseconds(5);
    std::this_thread::sleep_until(capture);

    // In the world, metres: body S_i at the end of every segment, and S_0 at the base.
    const double t_s = std::chrono::duration<double>(capture - start).count();
    softarm::SegmentVector u_rad(experiment.arm.dof());
    for (int i = 0; i < u_rad.size(); i += 2) u_rad.segment<2>(i) << 0.2 * std::sin(t_s), 0.0;
    std::vector<Eigen::Isometry3d> poses(experiment.arm.segments.size());
    softarm::forward_kinematics(experiment.arm, u_rad, poses);
    std::vector<int> ids = bodies.segment_ids;
    if (bodies.base_id >= 0) {
      Eigen::Isometry3d base = Eigen::Isometry3d::Identity();
      base.linear() = experiment.arm.base_rotation;
      base.translation() = experiment.arm.base_position_m;
      poses.insert(poses.begin(), base);
      ids.insert(ids.begin(), bodies.base_id);
    }

    // When the shutter was open, in us of any clock that runs steadily.
    frame.capture_time_us =
        std::chrono::duration_cast<std::chrono::microseconds>(capture.time_since_epoch()).count();
    frame.bodies.resize(poses.size());
    frame.num_bodies = static_cast<std::int16_t>(poses.size());
    for (std::size_t i = 0; i < poses.size(); ++i) {
      const Eigen::Quaterniond q(poses[i].linear());
      const Eigen::Vector3d p = poses[i].translation();
      frame.bodies[i] = {ids[i], true, {p.x(), p.y(), p.z()}, {q.w(), q.x(), q.y(), q.z()}};
    }
    lcm.publish(experiment.transport.lcm.mocap_channel, &frame);
  }
} catch (const std::exception& error) {
  return std::fprintf(stderr, "%s\n", error.what()), 1;
}
