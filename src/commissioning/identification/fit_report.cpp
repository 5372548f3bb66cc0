#include "softarm/commissioning/identification/fit_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace softarm {
namespace {

/// The largest parts of a combination of parameters, e.g. "+0.71 stiffness k -0.70 lag".
std::string combination_text(const ParameterSet& set, const Eigen::VectorXd& weights) {
  std::vector<Eigen::Index> order;
  for (Eigen::Index i = 0; i < set.size(); ++i) order.push_back(i);
  std::sort(order.begin(), order.end(), [&](Eigen::Index a, Eigen::Index b) {
    return std::abs(weights[a]) > std::abs(weights[b]);
  });
  const double sign = weights[order.front()] < 0.0 ? -1.0 : 1.0;
  std::string text;
  for (const Eigen::Index i : order) {
    if (std::abs(weights[i]) < 0.2) break;
    text += fmt::format("{}{:+.2f} ({} / {:.3g} {})", text.empty() ? "" : " ", sign * weights[i],
                        set[i].name, set[i].scale, set[i].unit);
  }
  return text;
}

template <class Value>
std::string list(int count, const Value& value) {
  std::string text = "[";
  for (int i = 0; i < count; ++i) text += fmt::format("{}{:.7g}", i > 0 ? ", " : "", value(i));
  return text + "]";
}

/// The chambers with the angles and gains of the input map, and the offsets of `actuation`.
std::string chambers_yaml(const ArmHypothesis& arm, const ActuationSettings& actuation,
                          const char* indent) {
  std::string text;
  for (int i = 0; i < arm.arm.size(); ++i) {
    std::vector<double> angles, gains;
    for (std::size_t j = 0; j < arm.segment_of.size(); ++j) {
      if (arm.segment_of[j] != i) continue;
      const Eigen::Vector2d push = -arm.input_map.col(static_cast<Eigen::Index>(j));
      gains.push_back(std::max(1e-9, push.norm()));
      double angle = std::atan2(push.y(), push.x());
      if (angle < -1e-12) angle += 2.0 * std::numbers::pi;
      angles.push_back(angle + 0.0);
    }
    const int count = static_cast<int>(gains.size());
    const auto of = [](const std::vector<double>& values) {
      return [&values](int j) { return values[static_cast<std::size_t>(j)]; };
    };
    std::string offsets;
    const std::vector<Chamber>& chambers = actuation.segments[static_cast<std::size_t>(i)];
    if (std::any_of(chambers.begin(), chambers.end(),
                    [](const Chamber& c) { return c.offset_m != Chamber{}.offset_m; })) {
      offsets = ", offset_m: " +
                list(count, [&](int j) { return chambers[static_cast<std::size_t>(j)].offset_m; });
    }
    text += fmt::format("{}  - {{angle_rad: {}, gain_nm_per_bar: {}{}}}\n", indent,
                        list(count, of(angles)), list(count, of(gains)), offsets);
  }
  return text;
}

/// Whether an experiment with these chambers loads: in every segment neighbours push less than half a
/// turn apart.
bool reaches_every_direction(const ArmHypothesis& arm) {
  constexpr double kLeastGain = 0.02;  ///< of the largest: less pushes nowhere
  for (int i = 0; i < arm.arm.size(); ++i) {
    std::vector<double> angles;
    double largest = 0.0;
    for (std::size_t j = 0; j < arm.segment_of.size(); ++j)
      if (arm.segment_of[j] == i)
        largest = std::max(largest, arm.input_map.col(static_cast<Eigen::Index>(j)).norm());
    for (std::size_t j = 0; j < arm.segment_of.size(); ++j) {
      const Eigen::Vector2d push = arm.input_map.col(static_cast<Eigen::Index>(j));
      if (arm.segment_of[j] != i) continue;
      if (push.norm() < kLeastGain * largest) return false;
      angles.push_back(std::atan2(push.y(), push.x()));
    }
    std::sort(angles.begin(), angles.end());
    double widest = angles.empty() ? 2.0 * std::numbers::pi
                                   : angles.front() + 2.0 * std::numbers::pi - angles.back();
    for (std::size_t k = 1; k < angles.size(); ++k)
      widest = std::max(widest, angles[k] - angles[k - 1]);
    if (widest > 0.95 * std::numbers::pi) return false;
  }
  return true;
}

/// "  name: [a, b]\n", nothing where all are `off`.
std::string row(const char* name, const Eigen::VectorXd& values, double off = 0.0) {
  if (values.size() == 0 || (values.array() == off).all()) return "";
  return fmt::format("  {}: {}\n", name,
                     list(static_cast<int>(values.size()), [&](int i) { return values[i]; }));
}
std::string row(const char* name, double value, double off = 0.0) {
  return value == off ? "" : fmt::format("  {}: {:.7g}\n", name, value);
}
std::string pairs(const char* name, const Eigen::VectorXd& values) {
  if (values.size() == 0 || values.isZero(0.0)) return "";
  std::string text;
  for (Eigen::Index i = 0; i < values.size(); i += 2)
    text += fmt::format("{}[{:.7g}, {:.7g}]", i > 0 ? ", " : "", values[i], values[i + 1]);
  return fmt::format("  {}: [{}]\n", name, text);
}

Eigen::VectorXd times(const std::vector<FillVentLag>& lags, double FillVentLag::*member) {
  Eigen::VectorXd out(static_cast<Eigen::Index>(lags.size()));
  for (std::size_t j = 0; j < lags.size(); ++j) out[static_cast<Eigen::Index>(j)] = lags[j].*member;
  return out;
}

std::string slip_yaml(const std::vector<SlipSpring>& springs) {
  Eigen::VectorXd radii(static_cast<Eigen::Index>(springs.size())), stiffness = radii;
  for (std::size_t k = 0; k < springs.size(); ++k) {
    radii[static_cast<Eigen::Index>(k)] = springs[k].radius_rad;
    stiffness[static_cast<Eigen::Index>(k)] = springs[k].stiffness_nm_per_rad;
  }
  if (stiffness.size() == 0 || stiffness.isZero(0.0)) return "";
  return row("slip_radius_rad", radii) + row("slip_stiffness_nm_per_rad", stiffness);
}

/// What is left of lags that the tick inverts, s: a shorter one tracks better and moves the valves
/// more (docs/explanation/actuator_inverse.md).
double lag_left_s(const std::vector<FillVentLag>& lags, double period_s) {
  constexpr double kShare = 0.1;
  double longest_s = 0.0;
  for (const FillVentLag& lag : lags) longest_s = std::max({longest_s, lag.fill_s, lag.vent_s});
  return std::clamp(kShare * longest_s, 2.0 * period_s, 2.0);
}

/// Whether filling and venting were identified, which the tick then inverts.
bool inverts_lags(const ArmHypothesis& arm, const FitChoice& choice) {
  return (choice.venting || choice.chamber_lags) && !arm.lags.empty();
}

/// `actuation.inverse`, of the terms that were identified and that it can invert.
std::string inverse_yaml(const ArmHypothesis& arm, const FitChoice& choice) {
  std::string text;
  if (inverts_lags(arm, choice)) {
    text += row("fill_lag_s", times(arm.lags, &FillVentLag::fill_s));
    text += row("vent_lag_s", times(arm.lags, &FillVentLag::vent_s));
  }
  if (choice.hysteresis) text += slip_yaml(arm.slip_springs);
  if (choice.stiffening && arm.stiffening_1pbar > 0.0)
    text += row("stiffening_per_bar", arm.stiffening_1pbar);
  if (text.empty()) return "";
  std::string indented = "  inverse:\n";
  for (std::size_t from = 0; from < text.size();) {
    const std::size_t end = text.find('\n', from) + 1;
    indented += "  " + text.substr(from, end - from);
    from = end;
  }
  return indented;
}

/// The keys of `identification` beyond lag, delay, cubic stiffness and rest; what is off is left out.
std::string memory_yaml(const ArmHypothesis& arm, bool directions) {
  std::string text = row("load_kg", arm.load_kg);
  if (!arm.inertia) text += "  inertia: false\n";
  if (directions) text += pairs("push_nm_per_bar", arm.input_map.reshaped());
  text += row("fill_lag_s", times(arm.lags, &FillVentLag::fill_s));
  text += row("vent_lag_s", times(arm.lags, &FillVentLag::vent_s));
  text += row("saturation_1pbar", arm.saturation_1pbar);
  text += row("stiffening_1pbar", arm.stiffening_1pbar);
  text += row("stiffening_by_length", arm.stiffening_by_length);
  text += row("cross_nm_per_bar", arm.cross_nm_per_bar.reshaped());
  text += slip_yaml(arm.slip_springs);
  if (arm.remanence.share != 0.0) {
    text += row("remanence", arm.remanence.share) + row("remanence_s", arm.remanence.time_s);
    text += pairs("remanent_u_rad", arm.remanent_rad);
  }
  if (arm.remanence_2.share != 0.0)
    text +=
        row("remanence_2", arm.remanence_2.share) + row("remanence_2_s", arm.remanence_2.time_s);
  const ElongationHypothesis& it = arm.elongation;
  if (!it.given()) return text;
  text += row("stretch_m_per_bar", it.gain_m_per_bar.reshaped());
  text += row("stretch_length_m", it.offset_m);
  text += row("stretch_fill_s", times(it.lags, &FillVentLag::fill_s));
  text += row("stretch_vent_s", times(it.lags, &FillVentLag::vent_s));
  text += row("stretch_saturation_1pbar", it.saturation_1pbar);
  text += row("stretch_friction_m", it.friction_m);
  if (it.remanence.share != 0.0)
    text += row("stretch_remanence", it.remanence.share) +
            row("stretch_remanence_s", it.remanence.time_s);
  if (it.remanence_2.share != 0.0)
    text += row("stretch_remanence_2", it.remanence_2.share) +
            row("stretch_remanence_2_s", it.remanence_2.time_s);
  text += row("stretch_set", it.set);
  text += row("stretch_by_bend_m_per_rad2", it.by_bend_m_per_rad2);
  return text;
}

/// Gravity, where it is not that of the configuration.
std::string gravity_yaml(const Eigen::Vector3d& gravity_mps2, const char* indent) {
  return fmt::format("{}gravity_mps2: {}\n", indent,
                     list(3, [&](int i) { return gravity_mps2[i]; }));
}

std::string segments_yaml(const ArmParameters& arm, const char* indent) {
  const auto of = [&](double SegmentParameters::*member) {
    return list(arm.size(),
                [&](int i) { return arm.segments[static_cast<std::size_t>(i)].*member; });
  };
  return fmt::format("{0}stiffness_nm_per_rad: {1}\n{0}damping_nms_per_rad: {2}\n", indent,
                     of(&SegmentParameters::stiffness_nm_per_rad),
                     of(&SegmentParameters::damping_nms_per_rad));
}

}  // namespace

std::string fit_table(const ParameterSet& set, const Refinement& fit) {
  std::string text = fmt::format("{:<32}{:>12}{:>12}  (95 % interval)\n", "", "value", "+-");
  for (Eigen::Index i = 0; i < set.size(); ++i)
    text += fmt::format("{:<32}{:>12.6g}{:>12.2g}  {}\n", set[i].name, fit.x[i] * set[i].scale,
                        fit.half_width(i) * set[i].scale, set[i].unit);
  text += fmt::format(
      "residual {:.3g} mrad rms a component, of a motion of {:.3g} mrad rms about its mean; {} "
      "frames, of which {:.3g} count as one\n",
      1e3 * fit.rms_rad, 1e3 * fit.motion_rms_rad, fit.time_s.size(), fit.inflation);
  if (!fit.converged)
    text += "THE SEARCH HAS NOT CONVERGED: seek fewer parameters, or give a longer record\n";
  return text;
}

std::string linear_table(const ParameterSet& set, const LinearFit& fit) {
  std::string text =
      fmt::format("{:<32}{:>12}{:>12}  (standard error)\n", "least squares alone", "value", "+-");
  for (Eigen::Index i = 0; i < set.size(); ++i)
    text += fmt::format("{:<32}{:>12.6g}{:>12.2g}  {}\n", set[i].name, fit.x[i] * set[i].scale,
                        fit.standard_error[i] * set[i].scale, set[i].unit);
  return text + fmt::format("residual {:.3g} N m rms, of moments of {:.3g} N m rms\n",
                            fit.residual_rms_nm, fit.moment_rms_nm);
}

std::string conditioning_text(const ParameterSet& set, const Refinement& fit) {
  const Eigen::Index kept = set.size() - fit.held;
  std::string text;
  if (kept > 0)
    text += fmt::format(
        "singular values {:.3g} to {:.3g} (1 over one is the standard error of its combination); "
        "least determined: {}\n",
        fit.singular_values[0], fit.singular_values[kept - 1],
        combination_text(set, fit.combinations.col(kept - 1)));
  for (Eigen::Index i = kept; i < set.size(); ++i)
    text += fmt::format("not determined by this record, left as configured: {}\n",
                        combination_text(set, fit.combinations.col(i)));
  return text;
}

std::string coverage_text(const CoverageTable& table) {
  std::string text = fmt::format("{:<32}{:>10}{:>10}{:>10}{:>12}{:>10}\n", "", "covered", "bias",
                                 "scatter", "half width", "worst");
  for (const CoverageRow& row : table.rows) {
    const double unit = row.relative ? 100.0 : 1e3;
    text +=
        fmt::format("{:<32}{:>6}/{:<3}{:>10.3f}{:>10.3f}{:>12.3f}{:>10.3f}  {}\n", row.name,
                    row.covered, table.seeds - table.failed, unit * row.bias, unit * row.scatter,
                    unit * row.half_width, unit * row.worst, row.relative ? "%" : "m" + row.unit);
  }
  if (table.failed > 0) text += fmt::format("{} searches did not converge\n", table.failed);
  return text;
}

std::string identified_yaml(const Experiment& experiment, const ArmHypothesis& arm,
                            const FitChoice& choice, const std::string& note,
                            const std::filesystem::path& config,
                            const std::filesystem::path& output) {
  namespace fs = std::filesystem;
  const fs::path folder = fs::absolute(output).parent_path();
  const bool chambers = experiment.actuation.kind == ActuationKind::chambers;
  std::string text = fmt::format("# {}\ninclude: {}\n\narm:\n{}", note,
                                 fs::proximate(fs::absolute(config), folder).string(),
                                 segments_yaml(arm.arm, "  "));
  std::string plant_too;
  const auto factor = [&](const char* key, double SegmentParameters::*member) {
    if (arm.arm.segments[0].*member == experiment.arm.segments[0].*member) return;
    const auto of = [&](const ArmParameters& it) {
      return list(it.size(),
                  [&](int i) { return it.segments[static_cast<std::size_t>(i)].*member; });
    };
    text += fmt::format("  {}: {}\n", key, of(arm.arm));
    plant_too += fmt::format("    {}: {}\n", key, of(experiment.plant.arm));
  };
  factor("mass_kg", &SegmentParameters::mass_kg);
  factor("length_m", &SegmentParameters::length_m);
  const bool turned = arm.arm.gravity_mps2 != experiment.arm.gravity_mps2;
  if (turned) text += gravity_yaml(arm.arm.gravity_mps2, "  ");
  // Chambers that cannot bend the arm to every side, as one identified from few motions, are no
  // actuation of a controller; they predict by `push_nm_per_bar`.
  const bool actuates = chambers && (!choice.directions || reaches_every_direction(arm));
  if (actuates)
    text += "\nactuation:\n  chambers:\n" + chambers_yaml(arm, experiment.actuation, "  ") +
            inverse_yaml(arm, choice);
  text += fmt::format(
      "\nidentification:\n  lag_s: {:.6g}\n  delay_s: {:.6g}\n  cubic_nm_per_rad3: {:.6g}\n"
      "  rest_u_rad: [",
      arm.lag_s, arm.dead_time_s, arm.cubic_nm_per_rad3);
  for (Eigen::Index i = 0; i < arm.arm.size(); ++i)
    text += fmt::format("{}[{:.6g}, {:.6g}]", i > 0 ? ", " : "", arm.rest_rad[2 * i],
                        arm.rest_rad[2 * i + 1]);
  text += "]\n" + memory_yaml(arm, choice.directions);
  // The controller inverts the lag on what depends on the reference alone.
  if (choice.lag && arm.lags.empty() && arm.lag_s <= 5.0)
    text += fmt::format("\ncontrol:\n  valve_lag_s: {:.6g}\n", arm.lag_s);
  if (actuates && inverts_lags(arm, choice))
    text += fmt::format(
        "\ncontrol:\n  # what actuation.inverse leaves of the lags\n"
        "  valve_lag_s: {:.6g}\n",
        lag_left_s(arm.lags, 1.0 / experiment.rate_hz));
  text += "\n# The simulated arm is what it was.\nplant:\n  arm:\n" +
          segments_yaml(experiment.plant.arm, "    ") + plant_too;
  if (turned) text += gravity_yaml(experiment.plant.arm.gravity_mps2, "    ");
  if (chambers)
    text += "  actuation:\n    chambers:\n" +
            chambers_yaml(of_plant(experiment), experiment.plant.actuation, "    ");
  return text;
}

std::string residuals_csv(const Refinement& fit) {
  std::string text = "time_s";
  const Eigen::Index dof = fit.measured_rad.cols();
  for (const char* name : {"measured", "simulated"})
    for (Eigen::Index c = 0; c < dof; ++c)
      text += fmt::format(",{}_u{}_{}_rad", name, c / 2 + 1, c % 2 == 0 ? "x" : "y");
  text += "\n";
  for (Eigen::Index k = 0; k < fit.time_s.size(); ++k) {
    text += fmt::format("{:.6f}", fit.time_s[k]);
    for (Eigen::Index c = 0; c < dof; ++c) text += fmt::format(",{:.8g}", fit.measured_rad(k, c));
    for (Eigen::Index c = 0; c < dof; ++c)
      text += fmt::format(",{:.8g}", fit.measured_rad(k, c) - fit.residual_rad(k, c));
    text += "\n";
  }
  return text;
}

}  // namespace softarm
