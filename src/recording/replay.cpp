#include "softarm/recording/replay.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "softarm/base/time.hpp"
#include "softarm/config/load.hpp"
#include "softarm/transport/message_decoding.hpp"
#include "softarm/transport/settings.hpp"

namespace softarm {

using softarm_messages::tick_record_t;

Replay::Replay(const Experiment& experiment, std::string build, bool any_configuration)
    : experiment_(experiment),
      build_(std::move(build)),
      any_configuration_(any_configuration),
      by_torque_(experiment.actuation.kind == ActuationKind::torque) {}

void Replay::take(const LogEvent& event) {
  const LcmSettings& lcm = experiment_.transport.lcm;
  const auto sequence = [](const auto& message) { return message.sequence; };
  const auto tick = [](const auto& message) { return message.tick; };
  if (event.channel == lcm.tick_channel) {
    take_record(event);
  } else if (event.channel == lcm.status_channel) {
    keep(event, statuses_, tick);
  } else if (event.channel == lcm.command_channel) {
    by_torque_ ? keep(event, torques_, sequence) : keep(event, pressures_, sequence);
  }
}

/// Commands and statuses wait for the record of their tick, which is sent after them.
template <class Message, class Tick>
void Replay::keep(const LogEvent& event, Window<Message>& window, Tick tick_of) {
  Waiting<Message>& incoming = window.incoming;
  if (!decode(event.data, incoming.message)) {
    ++summary_.malformed;
    return;
  }
  incoming.tick = tick_of(incoming.message);
  incoming.position = event.position;
  if (incoming.tick > 0) std::swap(window.at(incoming.tick), incoming);
}

void Replay::take_record(const LogEvent& event) {
  WaitingRecord& incoming = records_.incoming;
  const tick_record_t& record = incoming.message;
  if (!decode(event.data, incoming.message) || !is_intact(event.data) || !fits(record)) {
    ++summary_.malformed;
    return;
  }
  if (!running_ || record.first_ns != first_ns_) {
    end_run();
    begin_run(record);
  }
  if (!record.build.empty()) check_build(record.build);
  if (record.tick < next_) return;  // a repetition of a tick already replayed
  incoming.tick = record.tick;
  incoming.position = event.position;
  if (record.tick - next_ >= static_cast<std::int64_t>(kWindow)) {
    advance(0);
    if (record.tick > next_) add_gap(next_, record.tick - 1, incoming);
    next_ = record.tick;
  }
  newest_ = std::max(newest_, record.tick);
  std::swap(records_.at(record.tick), incoming);
  advance(kPatience);
}

/// Whether the record fits our arm and its times are small enough to calculate with.
bool Replay::fits(const tick_record_t& record) const {
  constexpr std::int64_t kMost = 4'000'000'000'000'000'000;
  const auto sane = [](std::int64_t number) { return number >= 0 && number < kMost; };
  const int dof = 2 * experiment_.arm.size();
  const auto frame_fits = [&](const softarm_messages::tick_frame_t& frame) {
    return frame.num_bodies == experiment_.arm.size() + 1 && frame.capture_ns > -kMost &&
           frame.capture_ns < kMost;
  };
  const auto chambers = static_cast<std::size_t>(chamber_count(experiment_.actuation));
  return record.tick > 0 && sane(record.tick) && sane(record.first_ns) && sane(record.now_ns) &&
         record.pressure_bar.size() == chambers &&
         (record.dimension == 0 || record.dimension == dof) &&
         (record.law_answer < 0 || (sane(record.law_state_ns) && sane(record.law_arrival_ns) &&
                                    sane(record.law_validity_ns))) &&
         std::all_of(record.frames.begin(), record.frames.end(), frame_fits);
}

void Replay::begin_run(const tick_record_t& first) {
  const auto recorded = static_cast<std::uint64_t>(first.configuration_hash);
  if (recorded != experiment_.hash && !any_configuration_)
    throw OtherConfiguration(fmt::format(
        "the log was recorded with configuration {}, this one is {}; --any-configuration replays "
        "all the same",
        hash_text(recorded), hash_text(experiment_.hash)));
  // Discards messages that wait from an earlier run: the clock shows that they precede this run.
  const auto forget = [&first](auto& window) {
    for (auto& each : *window.places)
      if (each.message.time_us < first.first_ns / 1000) each.tick = 0;
  };
  forget(pressures_);
  forget(torques_);
  forget(statuses_);
  for (auto& each : *records_.places) each.tick = 0;
  pipeline_ = std::make_unique<ControlPipeline>(experiment_);
  messages_ = std::make_unique<OutputMessages>(experiment_, Provenance{}, first.shadow != 0);
  running_ = exact_ = true;
  first_ns_ = last_ns_ = first.first_ns;
  next_ = 1;
  newest_ = 0;
  ++summary_.runs;
}

void Replay::end_run() {
  if (!running_) return;
  advance(0);
  summary_.duration_s += to_seconds(last_ns_ - first_ns_);
  running_ = false;
}

void Replay::finish() { end_run(); }

/// Replays all ticks that are available, in order. A tick that is `patience` ticks behind the
/// newest is missing.
void Replay::advance(std::int64_t patience) {
  while (next_ <= newest_) {
    WaitingRecord& waiting = records_.at(next_);
    if (waiting.tick == next_) {
      run(waiting);
      waiting.tick = 0;
      ++next_;
      continue;
    }
    if (newest_ - next_ <= patience) return;
    const std::int64_t first = next_;
    while (records_.at(next_).tick != next_) ++next_;
    add_gap(first, next_ - 1, records_.at(next_));
  }
}

void Replay::add_gap(std::int64_t first, std::int64_t last, const WaitingRecord& next) {
  exact_ = false;
  summary_.agrees_again = -1;
  summary_.missing_ticks += last - first + 1;
  ++summary_.gap_count;
  if (summary_.gaps.size() < ReplaySummary::kGapsKept)
    summary_.gaps.push_back(
        {first, last, next.position, to_seconds(next.message.now_ns - first_ns_)});
}

void Replay::run(const WaitingRecord& record) {
  pipeline_->tick(input_.from(record.message));
  ++summary_.ticks;
  last_ns_ = record.message.now_ns;
  compare(record);
}

void Replay::compare(const WaitingRecord& record) {
  const TickOutput& output = pipeline_->output();
  command_.assign(output.pressure_bar.begin(), output.pressure_bar.end());
  auto decided = differences(record.message.pressure_bar, command_, by_torque_ ? "N m" : "bar");
  if (!exact_) {
    ++summary_.after_gap.compared;
    if (!decided.empty()) {
      ++summary_.after_gap.different;
      summary_.agrees_again = -1;
    } else if (summary_.agrees_again < 0) {
      summary_.agrees_again = record.tick;
    }
    return;
  }
  ++summary_.records.compared;
  if (!decided.empty()) {
    ++summary_.records.different;
    note(std::move(decided), record, record.position, "tick");
  }
  messages_->set_command(record.tick, output);
  messages_->set_status(record.tick, *pipeline_);
  if (by_torque_) {
    compare_waiting(torques_, record, messages_->torque_command, "command", summary_.commands);
  } else {
    compare_waiting(pressures_, record, messages_->pressure_command, "command", summary_.commands);
  }
  compare_waiting(statuses_, record, messages_->status, "status", summary_.statuses);
}

template <class Message>
void Replay::compare_waiting(Window<Message>& window, const WaitingRecord& record,
                             Message& replayed, const char* name, ReplayCount& count) {
  Waiting<Message>& waiting = window.at(record.tick);
  if (waiting.tick != record.tick) return;
  waiting.tick = 0;
  replayed.time_us = waiting.message.time_us;  // read from the clock when it was sent
  ++count.compared;
  auto found = differences(waiting.message, replayed);
  if (found.empty()) return;
  ++count.different;
  note(std::move(found), record, waiting.position, name);
}

void Replay::note(std::vector<FieldDifference> fields, const WaitingRecord& record,
                  std::int64_t position, const char* message) {
  ReplayDifference& first = summary_.first;
  if (first.fields.empty()) {
    first.tick = record.tick;
    first.run = summary_.runs;
    first.time_s = to_seconds(record.message.now_ns - first_ns_);
    first.position = position;
  }
  if (first.tick != record.tick || first.run != summary_.runs) return;
  for (FieldDifference& each : fields) {
    each.field = fmt::format("{}.{}", message, each.field);
    first.fields.push_back(std::move(each));
  }
}

void Replay::check_build(const std::string& recorded) {
  if (summary_.recorded_build.empty()) summary_.recorded_build = recorded;
  if (recorded == build_) return;
  summary_.other_build = true;
  summary_.recorded_build = recorded;
}

}  // namespace softarm
