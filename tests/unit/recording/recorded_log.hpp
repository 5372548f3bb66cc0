// A log as lcm-logger writes it, of a run in lock step with everything in it that can go wrong.
#pragma once

#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "softarm/base/time.hpp"
#include "softarm/config/load.hpp"
#include "softarm/simulation/simulated_arm.hpp"
#include "softarm/transport/output_messages.hpp"
#include "softarm/transport/settings.hpp"
#include "softarm/transport/tick_record.hpp"

namespace softarm::test {

/// Events in LCM's format, by our own hand: number, time, lengths, channel, data.
class LogBytes {
 public:
  /// @param time_us  below zero: 0.1 ms after the one before
  void add(const std::string& channel, std::span<const std::byte> data, std::int64_t time_us = -1) {
    put(0xEDA1DA01, 4);
    put(static_cast<std::uint64_t>(number_), 8);
    put(static_cast<std::uint64_t>(time_us < 0 ? 1'000'000 + 100 * number_ : time_us), 8);
    ++number_;
    put(channel.size(), 4);
    put(data.size(), 4);
    bytes += channel;
    bytes.append(reinterpret_cast<const char*>(data.data()), data.size());
  }
  template <class Message>
  void add_message(const std::string& channel, const Message& message, std::int64_t time_us = -1) {
    std::vector<std::byte> data(static_cast<std::size_t>(message.getEncodedSize()));
    message.encode(data.data(), 0, static_cast<int>(data.size()));
    add(channel, data, time_us);
  }

  std::string bytes;

 private:
  void put(std::uint64_t value, int size) {
    for (int k = size - 1; k >= 0; --k) bytes += static_cast<char>(value >> (8 * k) & 0xff);
  }
  std::int64_t number_ = 0;
};

/// What a recorder may be kept from seeing.
struct Losses {
  /// Whether the logger got what was published as the `copy`th (1 or 2) record of a tick.
  std::function<bool(std::int64_t tick, int copy)> record = [](auto, auto) { return true; };
};

struct RecordedRun {
  std::vector<Mode> modes;  ///< of every tick
  std::int64_t ticks = 0;
};

/// Runs the pipeline on a simulated arm for `seconds` and appends to the log what a daemon would
/// have published. Faults: a body occluded, frames doubled, broken and kept back, the process
/// stopped, disarmed and armed, a live reference sent, a live target of the tip and the answers of
/// an external law where the experiment has these, and shut down.
inline RecordedRun record_run(const Experiment& experiment, double seconds, bool shadow,
                              LogBytes& log, const Losses& losses = {},
                              std::int64_t start_ns = 7'000'000'000) {
  const LcmSettings& lcm = experiment.transport.lcm;
  const Provenance provenance{
      .version = "test", .configuration_hash = experiment.hash, .seed = 1, .build = "this build"};
  ControlPipeline pipeline(experiment);
  OutputMessages messages(experiment, provenance, shadow);
  TickRecorder recorder(experiment, provenance, shadow);
  SimulatedArm arm(experiment.plant, 0);
  RecordedRun run;
  std::int64_t stopped_ns = 0, repeated = 0;
  const auto repeat = [&] {
    const auto bytes = recorder.take_oldest();
    if (!bytes.empty() && losses.record(++repeated, 2)) log.add(lcm.tick_channel, bytes);
    return !bytes.empty();
  };
  const std::int64_t period_ns = pipeline.period_ns();
  const auto ticks = to_ns(seconds) / period_ns;
  const SegmentVector zero = SegmentVector::Zero(2 * experiment.arm.size());
  const LiveReferenceInput reference{zero, zero, zero};
  const TipTargetInput target{{0.02, 0.01, -0.31}, {0.01, 0.0, 0.0}};
  LawInput law, next;
  bool answered = false;
  for (std::int64_t k = 1; k <= ticks; ++k) {
    const double part = static_cast<double>(k) / static_cast<double>(ticks);
    if (k == ticks * 6 / 10) stopped_ns = 300'000'000;
    const std::int64_t now_ns = start_ns + k * period_ns + stopped_ns + k * 37 % 1000;
    arm.advance_to(now_ns - start_ns);
    std::vector<MocapFrame> frames;
    for (MocapFrame frame; arm.receive(frame);) {
      frame.capture_ns += start_ns;
      if (part > 0.30 && part < 0.33) frame.body[1].valid = false;
      if (part > 0.40 && part < 0.42) continue;
      if (part > 0.45 && part < 0.46)
        frame.body[1].position_m.x() = std::numeric_limits<double>::quiet_NaN();
      frames.push_back(frame);
      if (part > 0.50 && part < 0.52) frames.push_back(frame);
    }
    TickInput input;
    input.now_ns = now_ns;
    input.frames = frames;
    if (k % 50 == 0) input.reference = &reference;
    if (k % 50 == 25) input.tip_target = &target;
    if (answered) {
      law = next;
      input.law = &law;
    }
    input.requests.disarm = k == ticks * 8 / 10;
    input.requests.arm = k % 40 == 0;
    input.requests.shutdown = part > 0.95;
    input.command_expired = k == ticks * 6 / 10;
    input.consecutive_overruns = k % 17 == 0 ? 1 : 0;
    const TickOutput& output = pipeline.tick(input);
    answered = output.law != nullptr && (part < 0.15 || part > 0.22);
    if (answered) {
      next = {now_ns, now_ns + period_ns / 2, 20'000'000, LawAnswer::force, PressureVector()};
      next.values = 0.5 * output.law->reference.u - 0.1 * output.law->u_rad;
      if (k % 31 == 0) next.values[0] = std::numeric_limits<double>::quiet_NaN();
    }
    messages.set_command(k, output);
    messages.pressure_command.time_us = messages.torque_command.time_us = now_ns / 1000 + 11;
    messages.by_torque() ? log.add_message(lcm.command_channel, messages.torque_command)
                         : log.add_message(lcm.command_channel, messages.pressure_command);
    messages.set_status(k, pipeline);
    messages.status.time_us = now_ns / 1000;
    messages.status.overruns = 3;
    log.add_message(lcm.status_channel, messages.status);
    if (recorder.full()) repeat();
    const auto bytes = recorder.record(k, input, output.pressure_bar);
    if (losses.record(k, 1)) log.add(lcm.tick_channel, bytes);
    const std::vector<double> pressures(output.pressure_bar.begin(), output.pressure_bar.end());
    arm.command(
        {.sequence = k, .validity_ns = 100'000'000, .shadow = false, .pressure_bar = pressures},
        now_ns - start_ns);
    run.modes.push_back(output.mode);
  }
  while (repeat()) {
  }
  run.ticks = ticks;
  return run;
}

}  // namespace softarm::test
