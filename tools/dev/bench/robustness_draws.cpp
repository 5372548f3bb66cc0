#include "dev/bench/robustness_draws.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <random>

#include "dev/bench/interleaved.hpp"
#include "softarm/commissioning/loop_check.hpp"

namespace softarm {
namespace {

struct Counts {
  int stable = 0, good = 0, unstable_foreseen = 0, unstable = 0;
  int sampled = 0, sampled_foreseen = 0;  ///< successes that were checked, and found unstable
  std::vector<double> errors_rad;
};

Counts counts_of(const DrawLimits& limits, const std::vector<Draw>& draws) {
  Counts out;
  for (const Draw& draw : draws) {
    out.stable += draw.stable() ? 1 : 0;
    out.good += draw.good(limits) ? 1 : 0;
    if (draw.stable()) out.errors_rad.push_back(draw.trial.u_rms_rad);
    if (draw.good(limits) && draw.growth_1ps) {
      ++out.sampled;
      out.sampled_foreseen += draw.foreseen_unstable() ? 1 : 0;
    }
    if (draw.stable()) continue;
    ++out.unstable;
    out.unstable_foreseen += draw.foreseen_unstable() ? 1 : 0;
  }
  return out;
}

}  // namespace

RobustnessScene drawn_scene(const DrawLimits& limits, std::uint64_t seed, std::uint64_t number) {
  std::seed_seq words{static_cast<std::uint32_t>(seed), static_cast<std::uint32_t>(seed >> 32),
                      static_cast<std::uint32_t>(number)};
  std::mt19937_64 random(words);
  const auto between = [&random](double low, double high) {
    // 53 bits: the same numbers with every library.
    return low + (high - low) * 0x1p-53 * static_cast<double>(random() >> 11);
  };
  RobustnessScene scene;
  scene.name = fmt::format("arm {}", number);
  std::vector<std::array<double, 4>> factors(kMaxSegments);
  for (auto& each : factors)
    for (double& factor : each) factor = 1.0 + between(-limits.parameters, limits.parameters);
  const double payload_kg = between(0.0, limits.payload_kg);
  const double lag_s = between(limits.least_lag_s, limits.largest_lag_s);
  const double dead_time_s = between(0.0, limits.dead_time_s);
  scene.change = [=](Experiment& e) {
    for (std::size_t i = 0; i < e.plant.arm.segments.size(); ++i) {
      SegmentParameters& segment = e.plant.arm.segments[i];
      segment.stiffness_nm_per_rad *= factors[i][0];
      segment.damping_nms_per_rad *= factors[i][1];
      segment.mass_kg *= factors[i][2];
      for (Chamber& chamber : e.plant.actuation.segments[i])
        chamber.gain_nm_per_bar *= factors[i][3];
    }
    e.plant.payload_kg.assign(e.plant.arm.segments.size(), 0.0);
    e.plant.payload_kg.back() = payload_kg;
    e.plant.valves.lag_s = lag_s;
    e.plant.valves.dead_time_s = dead_time_s;
  };
  return scene;
}

std::vector<Draw> run_draws(const DrawLimits& limits, std::uint64_t first, int draws,
                            std::uint64_t seed,
                            const std::function<Experiment(const std::string&)>& config,
                            const std::function<void(int)>& progress) {
  std::vector<Draw> out;
  for (int k = 0; k < draws; ++k) {
    progress(k);
    Draw draw;
    draw.number = first + static_cast<std::uint64_t>(k);
    draw.scene = drawn_scene(limits, seed, draw.number);
    const Experiment experiment =
        robustness_experiment(draw.scene, RobustnessLaw::observer_parameters, config);
    draw.trial = run(experiment, draw.scene, draw.number);
    if (!draw.good(limits) || draw.number % 10 == 0)
      draw.growth_1ps = disturbance_growth_1ps(experiment);
    out.push_back(std::move(draw));
  }
  return out;
}

std::string draws_table(const DrawLimits& limits, const std::vector<Draw>& draws) {
  const Counts counts = counts_of(limits, draws);
  const double percent = 100.0 / static_cast<double>(std::max<std::size_t>(1, draws.size()));
  std::string text = fmt::format(
      "{} arms: stiffness, damping, mass and gain of every segment within {:.0f} %, payload to "
      "{:.0f} g, lag {:.0f} to {:.0f} ms, dead time to {:.0f} ms\n"
      "stable {:.1f} %, within {:.3g} mrad {:.1f} %\n"
      "error of the stable ones: median {:.3g}, 90 % {:.3g}, 99 % {:.3g}, largest {:.3g} mrad\n",
      draws.size(), 100.0 * limits.parameters, 1e3 * limits.payload_kg, 1e3 * limits.least_lag_s,
      1e3 * limits.largest_lag_s, 1e3 * limits.dead_time_s, percent * counts.stable,
      1e3 * limits.good_rad, percent * counts.good, 1e3 * quantile(counts.errors_rad, 0.5),
      1e3 * quantile(counts.errors_rad, 0.9), 1e3 * quantile(counts.errors_rad, 0.99),
      1e3 * quantile(counts.errors_rad, 1.0));
  if (counts.unstable > 0)
    text +=
        fmt::format("of {} that were not stable, the method of softarm check finds {} unstable\n",
                    counts.unstable, counts.unstable_foreseen);
  if (counts.sampled > 0)
    text += fmt::format("of {} successes that were checked likewise it finds {} unstable\n",
                        counts.sampled, counts.sampled_foreseen);
  for (const Draw& draw : draws) {
    if (draw.good(limits)) continue;
    text +=
        fmt::format("{:<12} {:>12} mrad   growth of a disturbance {:+.3g} 1/s\n", draw.scene.name,
                    draw.trial.stayed_active ? fmt::format("{:.3g}", 1e3 * draw.trial.u_rms_rad)
                                             : "left ACTIVE",
                    draw.growth_1ps.value_or(0.0));
  }
  return text;
}

std::string draws_json(const DrawLimits& limits, const std::vector<Draw>& draws) {
  using Json = nlohmann::ordered_json;
  const Counts counts = counts_of(limits, draws);
  Json list = Json::array();
  for (const Draw& draw : draws) {
    Json one{{"number", draw.number},
             {"u_rms_rad", draw.trial.u_rms_rad},
             {"u_largest_rad", draw.trial.u_largest_rad},
             {"stayed_active", draw.trial.stayed_active}};
    if (draw.growth_1ps) one["growth_1ps"] = *draw.growth_1ps;
    list.push_back(std::move(one));
  }
  const Json report{{"draws", draws.size()},
                    {"stable", counts.stable},
                    {"good", counts.good},
                    {"good_rad", limits.good_rad},
                    {"arms", std::move(list)}};
  return report.dump() + "\n";
}

}  // namespace softarm
