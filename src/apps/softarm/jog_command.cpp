// softarm jog: one chamber by hand, for as long as a key is held.
#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <string>

#include "apps/program.hpp"
#include "apps/progress.hpp"
#include "apps/signals.hpp"
#include "apps/softarm/commands.hpp"
#include "apps/softarm/key_hold.hpp"
#include "apps/softarm/raw_terminal.hpp"
#include "softarm/base/clock.hpp"
#include "softarm/client/arm_listener.hpp"
#include "softarm/client/commander.hpp"
#include "softarm/config/load.hpp"

namespace softarm {
namespace {

constexpr std::int64_t kListen_ns = 500'000'000;  ///< for others, before the first command
constexpr std::int64_t kFrameCounts_ns = 200'000'000;
constexpr int kQuit = 'q';

struct JogOptions {
  std::string config;
  int segment = 1, chamber = 1;  ///< counted from 1
  double pressure_bar = 0.0;
};

/// What is wrong with the request; empty where nothing is.
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
      : experiment_(experiment),
        options_(options),
        node_(experiment.transport.lcm.url),
        commander_(experiment, node_),
        listener_(experiment, node_, false),
        filled_bar_(PressureVector::Constant(commander_.chambers(),
                                             experiment.actuation.min_pressure_bar)) {
    for (int i = 0; i + 1 < options.segment; ++i)
      valve_ += static_cast<int>(experiment.actuation.segments[static_cast<std::size_t>(i)].size());
    valve_ += options.chamber - 1;
    filled_bar_[valve_] = options.pressure_bar;
  }

  int run() {
    const std::int64_t listened_ns = monotonic_now_ns() + kListen_ns;
    while (monotonic_now_ns() < listened_ns && stop_requested == 0) node_.wait_until(listened_ns);
    if (const std::string other = listener_.other_commander(); !other.empty()) {
      print_error("softarm", other);
      return kExitOtherInstance;
    }
    listener_.commanding();
    const RawTerminal terminal;
    fmt::print("hold a key to fill chamber {} of segment {} with {:.3f} bar; q ends\n",
               options_.chamber, options_.segment, options_.pressure_bar);
    std::fflush(stdout);
    try {
      follow_keys(terminal);
    } catch (...) {
      commander_.vent_to_rest();
      throw;
    }
    commander_.vent_to_rest();
    return kExitOk;
  }

 private:
  void follow_keys(const RawTerminal& terminal) {
    Progress progress(true);
    KeyHold hold;
    std::int64_t before_ns = monotonic_now_ns();
    while (stop_requested == 0) {
      const std::int64_t now_ns = monotonic_now_ns();
      // Keys that queued up while we were held up (Ctrl-Z, fg) are not being held.
      if (now_ns - std::exchange(before_ns, now_ns) > KeyHold::kNext_ns) terminal.begin_anew();
      const int key = terminal.key();
      if (key == kQuit || key == RawTerminal::kGone) return;
      if (key != 0) hold.event(now_ns);
      const bool held = hold.held(now_ns);
      if (!held) beyond_.clear();  // the next press may try again
      if (held && beyond_.empty()) watch(now_ns);
      if (held && beyond_.empty())
        commander_.update(filled_bar_, experiment_.actuation.slew_bar_per_s, now_ns);
      else
        commander_.vent(now_ns);
      node_.wait_until(commander_.next_ns());
      listener_.look_at_clock();
      progress.update(text(held));
    }
  }

  void watch(std::int64_t now_ns) {
    const double most_rad = experiment_.identification.max_theta_rad;
    if (sees_arm(now_ns) && listener_.largest_theta_rad() > most_rad)
      beyond_ = fmt::format(
          "vented: a segment bends beyond identification.max_theta_rad of {:.3g} "
          "rad",
          most_rad);
    if (listener_.daemon_armed(now_ns)) beyond_ = "vented: a daemon is armed";
  }

  bool sees_arm(std::int64_t now_ns) const {
    return listener_.whole_frame_ns() > now_ns - kFrameCounts_ns;
  }

  std::string text(bool held) const {
    const auto valve = static_cast<std::size_t>(valve_);
    std::string text = fmt::format("{:<8} set {:.3f} bar  measured {}", held ? "HELD" : "released",
                                   commander_.sent_bar()[valve_],
                                   valve < listener_.measured_bar().size()
                                       ? fmt::format("{:.3f} bar", listener_.measured_bar()[valve])
                                       : "-");
    if (!sees_arm(monotonic_now_ns())) {
      text += "  no frame shows every segment: bend is not watched";
    } else {
      for (Eigen::Index k = 0; k + 1 < listener_.u_rad().size(); k += 2)
        text += fmt::format("  u{} ({:+.3f}, {:+.3f}) rad", k / 2 + 1, listener_.u_rad()[k],
                            listener_.u_rad()[k + 1]);
    }
    return text + (beyond_.empty() ? "" : "  " + beyond_);
  }

  const Experiment& experiment_;
  const JogOptions& options_;
  LcmNode node_;
  Commander commander_;
  ArmListener listener_;
  PressureVector filled_bar_;
  int valve_ = 0;
  std::string beyond_;
};

int jog(const JogOptions& options) {
  const Experiment experiment = load_experiment(options.config);
  if (const std::string wrong = refusal(experiment, options); !wrong.empty()) {
    print_error("softarm", wrong);
    return kExitUsage;
  }
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
      ->check(CLI::PositiveNumber);
  command->add_option("CHAMBER", options->chamber, "of the segment, counted from 1")
      ->required()
      ->check(CLI::PositiveNumber);
  command->add_option("PRESSURE", options->pressure_bar, "in bar")
      ->required()
      ->check(number_between(0.0, 1e3));
  command->callback([options] {
    if (const int code = jog(*options); code != kExitOk) throw CLI::RuntimeError(code);
  });
}

}  // namespace softarm
