#include "softarm/commissioning/identification/misfit.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace softarm {
namespace {

constexpr double kMisfit = 1.25;
constexpr double kExplains = 0.95;  ///< a cause leaves less of the residual
constexpr double kMost = 1.5;       ///< causes that leave more than this times the best are none
constexpr int kRounds = 25;
constexpr double kRadius = 0.3, kSlip = 0.05;  ///< of the spring that slips: of motion, of k

constexpr double kBlock_s = 0.5;

/// RMS of the means over `kBlock_s` beside that of means of white noise.
double slow_ratio(const Refinement& fit, double noise_rad) {
  double squares = 0.0, blocks = 0.0;
  for (Eigen::Index first = 0; first < fit.time_s.size();) {
    Eigen::Index end = first + 1;
    // Records stand one behind the other: time falls back where one begins.
    while (end < fit.time_s.size() && fit.time_s[end] >= fit.time_s[first] &&
           fit.time_s[end] - fit.time_s[first] < kBlock_s)
      ++end;
    const auto mean = fit.residual_rad.middleRows(first, end - first).colwise().mean();
    squares += static_cast<double>(end - first) * mean.squaredNorm();
    blocks += static_cast<double>(mean.size());
    first = end;
  }
  return std::sqrt(squares / blocks) / noise_rad;
}

struct Candidate {
  const char* name;
  bool FitChoice::*flag;
};
constexpr Candidate kCandidates[] = {
    {"load at the tip", &FitChoice::load}, {"length", &FitChoice::length},
    {"masses", &FitChoice::mass},          {"hysteresis", &FitChoice::hysteresis},
    {"rest offset", &FitChoice::rest},     {"cubic stiffness", &FitChoice::cubic},
};

}  // namespace

Misfit judge_misfit(const ArmHypothesis& start, ActuationKind kind, const FitChoice& choice,
                    std::span<const MotionRecord> records, const Refinement& fit,
                    const RefinementOptions& options, bool seek_causes) {
  Misfit out;
  out.shift.setZero(fit.x.size());
  double squares = 0.0;
  for (const MotionRecord& record : records) {
    if (!(record.noise_rad > 0.0)) return out;
    squares += record.noise_rad * record.noise_rad;
  }
  out.noise_rad = std::sqrt(squares / static_cast<double>(records.size()));
  out.ratio = fit.rms_rad / out.noise_rad;
  out.slow_ratio = slow_ratio(fit, out.noise_rad);
  out.significant = out.ratio > kMisfit || out.slow_ratio > kMisfit;
  if (!out.significant || !seek_causes) return out;

  const ParameterSet set(start, kind, choice);
  struct Tried {
    MisfitCause cause;
    Eigen::VectorXd shift;
  };
  std::vector<Tried> all;
  for (const Candidate& candidate : kCandidates) {
    if (choice.*candidate.flag) continue;
    FitChoice with = choice;
    with.*candidate.flag = true;
    ArmHypothesis from = start;
    if (candidate.flag == &FitChoice::hysteresis && from.slip_springs.empty())
      from.slip_springs = {
          {kRadius * fit.motion_rms_rad, kSlip * from.arm.segments[0].stiffness_nm_per_rad}};
    const ParameterSet wider(from, kind, with);
    // The unknowns of both are in the same order, but for what was added.
    Eigen::VectorXd x = wider.expected();
    std::vector<Eigen::Index> common(static_cast<std::size_t>(set.size()), -1);
    Eigen::Index added = -1;
    for (Eigen::Index j = 0; j < wider.size(); ++j) {
      bool known = false;
      for (Eigen::Index i = 0; i < set.size(); ++i)
        if (wider[j].name == set[i].name) {
          common[static_cast<std::size_t>(i)] = j;
          x[j] = fit.x[i] * set[i].scale / wider[j].scale;
          known = true;
        }
      if (!known && added < 0) added = j;
    }
    if (added < 0) continue;
    RefinementOptions quick = options;
    quick.most_rounds = kRounds;
    try {
      const Refinement tried = refine(wider, records, x, quick);
      const double slow = slow_ratio(tried, out.noise_rad);
      if (!(slow < kExplains * out.slow_ratio)) continue;
      Tried it{{candidate.name, tried.x[added] * wider[added].scale, wider[added].unit,
                tried.rms_rad, slow},
               Eigen::VectorXd::Zero(set.size())};
      for (Eigen::Index i = 0; i < set.size(); ++i) {
        const Eigen::Index j = common[static_cast<std::size_t>(i)];
        if (j < 0) continue;
        const double scale = wider[j].scale / set[i].scale;
        it.shift[i] = std::abs(tried.x[j] * scale - fit.x[i]) + tried.half_width(j) * scale;
      }
      all.push_back(std::move(it));
    } catch (const std::runtime_error&) {
      continue;  // no bounded response: no explanation
    }
  }
  std::sort(all.begin(), all.end(),
            [](const Tried& a, const Tried& b) { return a.cause.slow_ratio < b.cause.slow_ratio; });
  for (const Tried& each : all) {
    if (each.cause.slow_ratio > kMost * all.front().cause.slow_ratio) break;
    out.causes.push_back(each.cause);
    out.shift = out.shift.cwiseMax(each.shift);
  }
  return out;
}

void widen(const Misfit& misfit, Refinement& fit) {
  if (!misfit.significant || !(fit.quantile > 0.0)) return;
  const Eigen::VectorXd standard = misfit.shift / fit.quantile;
  fit.covariance.diagonal() += standard.cwiseAbs2();
}

std::string misfit_text(const Misfit& misfit) {
  if (!misfit.significant) return "";
  std::string text = fmt::format(
      "THE ARM IS NOT AS MODELLED: the residual is {:.3g} times the noise configured for the "
      "frames ({:.3g} mrad); its means over half a second are {:.3g} times theirs\n",
      misfit.ratio, 1e3 * misfit.noise_rad, misfit.slow_ratio);
  for (const MisfitCause& cause : misfit.causes)
    text += fmt::format("{}: {} ({:.4g} {}), which leaves {:.3g} and {:.3g} times\n",
                        &cause == &misfit.causes.front() ? "likely cause" : "or", cause.name,
                        cause.value, cause.unit == "1" ? "times" : cause.unit,
                        cause.rms_rad / misfit.noise_rad, cause.slow_ratio);
  if (misfit.causes.empty())
    return text +
           "no cause is known: intervals count noise only; --choose-terms and --load, --length, "
           "--mass "
           "seek one\n";
  return text + "intervals are widened by what these causes would change; free one to know more\n";
}

}  // namespace softarm
