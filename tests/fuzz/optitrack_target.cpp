// OptiTrack's frames, read by our own walk over the bytes: what it accepts LCM's decoder takes to
// the last byte, and both read the same.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <softarm_messages/optitrack_frame_t.hpp>

#include "fuzz/target.hpp"
#include "softarm/transport/mocap_format.hpp"
#include "unit/transport/messages.hpp"

namespace softarm::test {
namespace {

using softarm_messages::optitrack_frame_t;

/// Bit for bit: NaN is itself.
template <std::size_t kSize>
bool same(const std::array<double, kSize>& ours, const float* theirs) {
  return std::equal(ours.begin(), ours.end(), theirs, [](double our, float their) {
    const auto wide = static_cast<double>(their);
    return std::memcmp(&our, &wide, sizeof our) == 0;
  });
}

}  // namespace

void run_optitrack(std::span<const std::byte> input) {
  static SentFrame frame;
  static const auto format = mocap_sources().find("optitrack")->make();
  if (!format->decode(input, frame)) return;
  optitrack_frame_t message;
  require(message.decode(input.data(), 0, static_cast<int>(input.size())) ==
              static_cast<int>(input.size()),
          "LCM takes what was accepted, all of it");
  require(frame.frame_number == message.frame && frame.bodies == message.rigid_bodies.size(),
          "numbers are LCM's");
  require(!(std::abs(message.timestamp) < 4e9) ||
              std::abs(1e-6 * static_cast<double>(frame.sender_time_us) - message.timestamp) < 1e-6,
          "the time is LCM's, to a microsecond");
  for (std::size_t k = 0; k < frame.bodies; ++k) {
    const SentBody& ours = frame.body[k];
    const auto& theirs = message.rigid_bodies[k];
    require(ours.id == theirs.id && ours.seen == ((theirs.params & 1) != 0) &&
                same(ours.position, theirs.xyz) && same(ours.orientation, theirs.quat),
            "bodies are LCM's");
  }
}

std::vector<Bytes> optitrack_seeds() {
  optitrack_frame_t full{};
  softarm_messages::optitrack_marker_set_t set{};
  set.name = "arm";
  set.num_markers = 1;
  set.xyz.assign(1, {1.0F, 2.0F, 3.0F});
  full.num_marker_sets = 1;
  full.marker_sets = {set};
  full.num_other_markers = 1;
  full.other_markers.assign(1, {4.0F, 5.0F, 6.0F});
  softarm_messages::optitrack_rigid_body_t body{};
  body.id = 7;
  body.params = 1;
  body.num_markers = 1;
  body.marker_xyz.assign(1, {7.0F, 8.0F, 9.0F});
  body.marker_ids = {1};
  body.marker_sizes = {0.01F};
  full.num_rigid_bodies = 2;
  full.rigid_bodies = {body, softarm_messages::optitrack_rigid_body_t{}};
  softarm_messages::optitrack_skeleton_t skeleton{};
  skeleton.num_rigid_bodies = 1;
  skeleton.rigid_bodies = {body};
  full.num_skeletons = 1;
  full.skeletons = {skeleton};
  full.num_labeled_markers = 1;
  full.labeled_markers.resize(1);
  full.num_forceplates = 1;
  full.forceplates.resize(1);
  optitrack_frame_t usual{};
  usual.num_rigid_bodies = 2;
  usual.rigid_bodies = {body, body};
  return {encoded(optitrack_frame_t{}), encoded(usual), encoded(full)};
}

}  // namespace softarm::test
