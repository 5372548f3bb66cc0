#include "apps/softarmd/loop_reports.hpp"

#include <utility>

namespace softarm {

void LoopReports::report(std::int64_t now_ns, Mode mode) {
  report_refused(now_ns);
  report_streams(now_ns, mode);
  report_mocap();
  report_validity();
}

void LoopReports::report_refused(std::int64_t now_ns) {
  constexpr std::int64_t kPause_ns = 1'000'000'000;
  const std::int64_t refused = loop_.link().malformed();
  const std::int64_t left_out = loop_.pipeline().frames_left_out();
  if (now_ns < refused_reported_ns_ + kPause_ns) return;
  if (refused != refused_)
    log_.add("{} malformed messages refused, {} in all", refused - refused_, refused);
  if (left_out != left_out_)
    log_.add("{} frames too many in one tick for the observer, {} in all", left_out - left_out_,
             left_out);
  if (refused != refused_ || left_out != left_out_) refused_reported_ns_ = now_ns;
  refused_ = refused;
  left_out_ = left_out;
}

void LoopReports::report_streams(std::int64_t now_ns, Mode mode) {
  const InputReport::Counts counts{
      .mode = mode,
      .frames = loop_.pipeline().counters(),
      .late_frames = loop_.pipeline().late_frames(),
      .frame_channel = lcm_.mocap_channel,
      .measurements = {lcm_.measurement_channel, loop_.link().backward_measurements()},
      .references = {lcm_.reference_channel, loop_.link().backward_references()},
      .live = loop_.link().live_counts(loop_.pipeline()),
      .answers = loop_.link().law_counts(loop_.pipeline())};
  for (const auto report : {&InputReport::refusals, &InputReport::refused_references,
                            &InputReport::refused_answers, &InputReport::second_sender})
    if (const auto text = (inputs_.*report)(now_ns, counts); !text.empty()) log_.add("{}", text);
}

void LoopReports::report_mocap() {
  if (std::exchange(standing_, loop_.link().mocap_standing()) != standing_)
    log_.add("motion capture: {} {}", standing_->text(), standing_->body);
}

void LoopReports::report_validity() {
  if (loop_.link().held_us() == held_us_) return;
  held_us_ = loop_.link().held_us();
  if (held_us_ < loop_.link().asked_us())
    log_.add(
        "commands are valid for {:.3g} s (daemon.lcm.command_validity_s), but the valve side lets "
        "them expire after {:.3g} s",
        1e-6 * loop_.link().asked_us(), 1e-6 * held_us_);
}

}  // namespace softarm
