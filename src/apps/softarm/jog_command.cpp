// softarm jog: fills one chamber while a key is held.
#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <string>
#include <utility>

#include "apps/program.hpp"
#include "apps/progress.hpp"
#include "apps/signals.hpp"
#include "apps/softarm/commands.hpp"
#include "apps/softarm/key_hold.hpp"
#include "apps/softarm/raw_terminal.hpp"
#include "softarm/client/arm_client.hpp"
#include "softarm/config/load.hpp"
#include "softarm/model/arm.hpp"
#include "softarm/model/chambers.hpp"

namespace softarm {
namespace {

constexpr double kListen_s = 0.5;  ///< for other senders, before the first command
constexpr std::int64_t kFrameCounts_ns = 200'000'000;
constexpr int kQuit = 'q';

struct JogOptions {
  std::string config;
  int segment = 1, chamber = 1;  ///< counted from 1
  double pressure_bar = 0.0;
};

/// The fault of the request; empty if it has none.
std::string refusal(const Experiment& experiment, const JogOptions& options) {
  const ActuationSettings& actuation = experiment.actuation;
  if (actuation.kind == ActuationKind::torque)
    return "expected actuation by chambers, got torque: there is no chamber to fill";
  if (options.segment > experiment.arm.size())
    return fmt::format("SEGMENT: expected 1 to {}, got {}", experiment.arm.size(), options.segment);
  const std::size_t chambers =
      actuation.segments[static_cast<std::size_t>(options.segment - 1)].size();
  if (static_cast<std::size_t>(options.chamber) > chambers)
    return fmt::format("CHAMBER: expected 1 to {} in segment {}, got {}", chambers, options.segment,
                       options.chamber);
  if (options.pressure_bar > actuation.max_pressure_bar)
    return fmt::format(
        "PRESSURE: expected at most actuation.max_pressure_bar of {} bar, got {} bar",
        actuation.max_pressure_bar, options.pressure_bar);
  return "";
}

class Jog {
 public:
  Jog(const Experiment& experiment, const JogOptions& options)
      : options_(options), client_(experiment) {
    client_.lock_commands();
    filled_bar_ = PressureVector::Constant(client_.set_points_bar().size(),
                                           experiment.actuation.min_pressure_bar);
    for (int i = 0; i + 1 < options.segment; ++i)
      valve_ += std::ssize(experiment.actuation.segments[static_cast<std::size_t>(i)]);
    valve_ += options.chamber - 1;
    filled_bar_[valve_] = options.pressure_bar;
  }

  int run() {
    client_.wait_for([] { return stop_requested != 0; }, kListen_s);
    if (const std::string other = client_.other_commander(); !other.empty())
      return fail("softarm", kExitOtherInstance, other);
    const RawTerminal terminal;
    fmt::print("hold a key to fill chamber {} of segment {} with {:.3f} bar; q ends\n",
               options_.chamber, options_.segment, options_.pressure_bar);
    std::fflush(stdout);
    follow_keys(terminal);
    client_.vent_to_rest();
    return kExitOk;
  }

 private:
  void follow_keys(const RawTerminal& terminal) {
    Progress progress(true);
    KeyHold hold;
    std::int64_t before_ns = client_.now_ns();
    while (stop_requested == 0) {
      const std::int64_t now_ns = client_.now_ns();
      // Keys queued while the program was stopped (Ctrl-Z, fg) are not being held.
      if (now_ns - std::exchange(before_ns, now_ns) > KeyHold::kNext_ns) terminal.restart();
      const int key = terminal.key();
      if (key == kQuit || key == RawTerminal::kGone) return;
      if (key != 0) hold.event(now_ns);
      const bool held = hold.held(now_ns);
      if (!held) beyond_.clear();  // the next press may try again
      if (held && beyond_.empty()) watch();
      if (held && beyond_.empty())
        client_.command_chambers(filled_bar_);
      else
        client_.vent();
      client_.update(client_.next_command_ns());
      progress.update(text(held));
    }
  }

  void watch() {
    const double most_rad = client_.experiment().motion_limits.max_theta_rad;
    if (sees_arm() && client_.seen().bend_rad > most_rad)
      beyond_ = fmt::format(
          "vented: a segment bends beyond identification.max_theta_rad of {:.3g} rad", most_rad);
    if (const std::string other = client_.other_commander(); !other.empty())
      beyond_ = client_.daemon_armed() ? "vented: a daemon is armed" : "vented: " + other;
  }

  bool sees_arm() const {
    const std::int64_t seen_ns = client_.seen().arrival_ns;
    return seen_ns != kNever && client_.now_ns() - seen_ns < kFrameCounts_ns;
  }

  std::string text(bool held) const {
    const auto& measured = client_.measured();
    std::string text = fmt::format("{:<8} set {:.3f} bar  measured {}", held ? "HELD" : "released",
                                   client_.set_points_bar()[valve_],
                                   measured && valve_ < measured->bar.size()
                                       ? fmt::format("{:.3f} bar", measured->bar[valve_])
                                       : "-");
    if (!sees_arm()) {
      text += "  no frame shows every segment: bend is not watched";
    } else {
      const SegmentVector& u_rad = client_.seen().u_rad;
      for (Eigen::Index k = 0; k + 1 < u_rad.size(); k += 2)
        text += fmt::format("  u{} ({:+.3f}, {:+.3f}) rad", k / 2 + 1, u_rad[k], u_rad[k + 1]);
    }
    return text + (beyond_.empty() ? "" : "  " + beyond_);
  }

  const JogOptions& options_;
  ArmClient client_;
  PressureVector filled_bar_;
  Eigen::Index valve_ = 0;
  std::string beyond_;
};

int jog(const JogOptions& options) {
  const Experiment experiment = load_experiment(options.config);
  if (const std::string wrong = refusal(experiment, options); !wrong.empty())
    return fail("softarm", kExitUsage, wrong);
  catch_stop_signals();
  ignore_broken_pipes();
  return Jog(experiment, options).run();
}

}  // namespace

void add_jog_command(CLI::App& app) {
  auto options = std::make_shared<JogOptions>();
  CLI::App* command = app.add_subcommand(
      "jog",
      "MOVES THE ARM: fill one chamber while a key is held, within the configured limits; softarmd "
      "must not run");
  command->add_option("CONFIG", options->config, "experiment in YAML")->required();
  command->add_option("SEGMENT", options->segment, "counted from 1 at the base")
      ->required()
      ->check(CLI::Range(1, kMaxSegments));
  command->add_option("CHAMBER", options->chamber, "of the segment, counted from 1")
      ->required()
      ->check(CLI::Range(1, kMaxChambersPerSegment));
  command->add_option("PRESSURE", options->pressure_bar, "in bar")
      ->required()
      ->check(number_between(0.0, 1e3));
  run_where_given(*command, [options] { return jog(*options); });
}

}  // namespace softarm
