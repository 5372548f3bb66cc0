#include "fuzz/decoder_target.hpp"
#include "fuzz/target.hpp"

namespace softarm::test {

const std::vector<FuzzTarget>& fuzz_targets() {
  using namespace softarm_messages;
  constexpr long kLong = 1'000'000;
  static const std::vector<FuzzTarget> targets = {
      decoder<mocap_frame_t>(),
      decoder<pressure_command_t>(),
      decoder<torque_command_t>(),
      decoder<pressure_measurement_t>(),
      decoder<curvature_reference_t>(),
      decoder<operator_command_t>(),
      decoder<deadman_t>(),
      decoder<controller_status_t>(),
      decoder<plant_state_t>(),
      decoder<timing_t>(),
      decoder<tick_record_t>(),
      decoder<valves_status_t>(),
      decoder<observer_status_t>(),
      decoder<rigid_transform_t>(),
      decoder<law_state_t>(),
      decoder<law_command_t>(),
      decoder<tip_target_t>(),
      {"optitrack_frame_t", run_optitrack, optitrack_seeds, decoder_words, 2048, 10'000'000},
      {"mocap_sources", run_mocap, mocap_seeds, decoder_words, 2048, 10'000'000},
      {"natnet", run_natnet, natnet_seeds, decoder_words, 2048, 10'000'000},
      {"qtm", run_qtm, qtm_seeds, qtm_words, 2048, 10'000'000},
      {"yaml", run_yaml, yaml_seeds, yaml_words, 4096, kLong},
      {"log", run_log, log_seeds, log_words, 4096, kLong},
      {"replay", run_replay, replay_seeds, replay_words, 8192, kLong},
      {"timeline", run_timeline, timeline_seeds, decoder_words, 4096, kLong},
      {"table", run_table, table_seeds, table_words, 4096, kLong},
      {"recording", run_recording, recording_seeds, recording_words, 4096, kLong},
      {"frames", run_frames, frames_seeds, decoder_words, 4096, 100'000},
  };
  return targets;
}

}  // namespace softarm::test
