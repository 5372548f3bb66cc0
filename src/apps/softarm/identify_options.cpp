#include "apps/softarm/identify_options.hpp"

#include <map>

#include "apps/program.hpp"

namespace softarm {
namespace {

constexpr double kLongest_s = 1e8;

void add_source_options(CLI::App& command, IdentifyCommand& options) {
  auto* log =
      command
          .add_option("--log", options.logs,
                      "identify from this LCM log (softarm import, lcm-logger) instead of steps; "
                      "given several times: from all, which must share one zero (softarm import "
                      "--frames-from)")
          ->allow_extra_args(false);
  command
      .add_option("--held-out", options.held_out,
                  "a further log, never identified from: how well it is predicted, and, with "
                  "--choose-terms and --compare, what terms are judged by")
      ->allow_extra_args(false)
      ->needs(log);
  command
      .add_flag("--live", options.live,
                "play the steps over LCM on the running plant or hardware, within the limits of "
                "the section identification; Ctrl-C vents")
      ->excludes(log);
  const std::map<std::string, LoggedInput> inputs = {{"commanded", LoggedInput::commanded},
                                                     {"measured", LoggedInput::measured}};
  command.add_option("--input", options.input, "pressures of the log: commanded or measured")
      ->transform(one_word_of(inputs));
  command.add_option("--from", options.from_s, "begin in the log, s after its first frame")
      ->check(number_between(0.0, kLongest_s));
  command.add_option("--to", options.to_s, "end in the log (default: its end)")
      ->check(number_between(0.0, kLongest_s));
  command.add_option("--skip", options.skip_s, "simulate so many s before comparing")
      ->check(number_between(0.0, kLongest_s));
  command.add_option("--apart", options.apart_s, "take frames of the log at least so many s apart")
      ->check(number_between(0.0, 10.0));
  command
      .add_option("--bend", options.plan.bend_rad,
                  "with actuation by torque: largest step, as the bend in rad that the "
                  "configured stiffness would allow")
      ->check(number_between(0.01, 3.0))
      ->capture_default_str();
}

void add_choice_options(CLI::App& command, IdentifyCommand& options) {
  command.add_flag("--per-segment", options.choice.per_segment,
                   "k and beta of every segment instead of one for all");
  const std::map<std::string, GainSharing> sharing = {{"arm", GainSharing::arm},
                                                      {"side", GainSharing::side},
                                                      {"segment", GainSharing::segment},
                                                      {"chamber", GainSharing::chamber}};
  command
      .add_option("--gains", options.choice.gains,
                  "separate gains for each: arm, side, segment or (default) chamber")
      ->transform(one_word_of(sharing));
  command.add_flag("--no-stiffness", options.no_stiffness,
                   "k as configured: for slow motion, which determines ratios only");
  command.add_flag("--no-damping", options.no_damping, "beta as configured");
  command.add_flag("--no-inertia", options.no_inertia,
                   "leave inertia out, for motions so slow that it does not count: much quicker "
                   "where beta is large");
  command.add_flag("--no-lag", options.no_lag, "the lag is identification.lag_s");
  command.add_flag("--no-delay", options.no_delay, "the delay is identification.delay_s");
  command.add_flag("--rest", options.choice.rest, "fit the rest shape of the springs");
  command.add_flag("--cubic", options.choice.cubic, "fit a cubic stiffness");
  command.add_flag("--directions", options.choice.directions,
                   "fit the direction in which every chamber bends its segment");
  command.add_flag("--venting", options.choice.venting,
                   "fit one lag for filling and one for venting");
  command.add_flag("--chamber-lags", options.choice.chamber_lags, "the same of every chamber");
  command.add_flag("--saturation", options.choice.saturation,
                   "fit how every chamber's push bends off with pressure");
  command.add_flag("--remanence", options.choice.remanence, "fit a rest that follows the bend");
  command.add_flag("--second-remanence", options.choice.second_remanence,
                   "fit another one that follows faster");
  command.add_flag("--stiffening", options.choice.stiffening, "fit a stiffness that pressures add");
  command.add_flag("--stiffening-by-length", options.choice.by_length,
                   "fit a stiffness that follows the length by identification.stretch_m_per_bar");
  command.add_flag("--cross", options.choice.cross, "fit forces of chambers on other segments");
  command.add_flag("--mass", options.choice.mass, "fit one factor on all masses");
  command.add_flag("--load", options.choice.load, "fit a point mass at the tip");
  command.add_flag("--length", options.choice.length, "fit one factor on all lengths");
  command
      .add_option("--prior", options.options.refinement.prior,
                  "how far, in parts of it, every number may be off what is configured (one "
                  "standard deviation); 0: nothing is known before")
      ->check(number_between(0.0, 1e6))
      ->capture_default_str();
}

}  // namespace

void add_identify_options(CLI::App& command, IdentifyCommand& options) {
  command.add_option("CONFIG", options.config, "experiment in YAML")->required();
  command.add_option("--output", options.output,
                     "write an experiment that includes CONFIG and has the values found");
  command.add_option("--out", options.out, "folder for what plots need");
  add_source_options(command, options);
  add_choice_options(command, options);
  command.add_flag("--linear", options.linear,
                   "linear least squares alone: quick, biased by noise and smoothing");
  command.add_flag("--predict", options.predict,
                   "identify nothing, but print how well CONFIG predicts the motion");
  command.add_flag("--compare", options.compare,
                   "what each further term gains, on the whole record and from half to half");
  command.add_flag("--choose-terms", options.choose,
                   "add terms as long as they predict better what was not seen: the other half of "
                   "one log, each of several logs by the others, or --held-out");
  command.add_flag("--stretch", options.stretch,
                   "identify how the segments stretch, too, in the same way");
  command.add_option("--hold", options.plan.hold_s, "time between steps in s")
      ->check(number_between(0.1, 100.0));
  command
      .add_option("--longest-lag", options.options.longest_lag_s,
                  "longest lag in s that the start of the search considers")
      ->check(number_between(0.0, 100.0))
      ->capture_default_str();
  command
      .add_option("--window", options.options.window_s,
                  "width in s of the window that smooths for the start")
      ->check(number_between(0.005, 10.0))
      ->capture_default_str();
  command
      .add_option("--seed", options.seed,
                  "seed of noise and dropouts (default: the configuration's)")
      ->check(seed_number());
  command
      .add_option("--seeds", options.study.seeds,
                  "do it on so many arms drawn at random, and print how often the "
                  "intervals hold the truth")
      ->check(CLI::Range(1, 100000))
      ->excludes("--live")
      ->excludes("--log");
  command
      .add_option("--spread", options.study.spread,
                  "with --seeds: how far the truth is off the configured, at most")
      ->check(number_between(0.0, 0.9))
      ->capture_default_str();
}

}  // namespace softarm
