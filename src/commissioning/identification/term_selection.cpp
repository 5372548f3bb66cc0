#include "softarm/commissioning/identification/term_selection.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace softarm {
namespace {

struct Term {
  const char* name;
  bool FitChoice::*flag;
};

constexpr Term kOfBend[] = {
    {"filling and venting", &FitChoice::venting},
    {"rest", &FitChoice::rest},
    {"cross-coupling", &FitChoice::cross},
    {"hysteresis", &FitChoice::hysteresis},
    {"saturation", &FitChoice::one_saturation},
    {"saturation of every chamber", &FitChoice::saturation},
    {"lags of every chamber", &FitChoice::chamber_lags},
    {"masses", &FitChoice::mass},
    {"remanence", &FitChoice::remanence},
    {"second remanence", &FitChoice::second_remanence},
    {"delay", &FitChoice::delay},
    {"stiffening", &FitChoice::stiffening},
    {"cubic stiffness", &FitChoice::cubic},
};
constexpr Term kOfElongation[] = {
    {"set", &FitChoice::set},
    {"bend", &FitChoice::by_bend},
    {"remanence", &FitChoice::remanence},
    {"second remanence", &FitChoice::second_remanence},
    {"saturation", &FitChoice::one_saturation},
    {"saturation of every chamber", &FitChoice::saturation},
    {"friction", &FitChoice::hysteresis},
    {"lags of every chamber", &FitChoice::chamber_lags},
    {"cross-coupling", &FitChoice::cross},
};
constexpr double kPriors[] = {2.0, 0.5, 0.25};  ///< tried at the end, times that given
constexpr double kLeastGain = 0.05;             ///< of a search, in squared standard errors
constexpr int kRevisions = 2;                   ///< rounds over all terms after the first
constexpr double kRadii[] = {0.3, 1.0, 2.5};    ///< of slip springs, of the motion's RMS

/// RMS of a component of the motion about its mean.
double motion_rms(const Eigen::MatrixXd& rows) {
  const Eigen::RowVectorXd mean = rows.colwise().mean();
  return std::sqrt((rows.rowwise() - mean).squaredNorm() / static_cast<double>(rows.size()));
}

/// One choice in every fold.
struct Attempt {
  TermTrial trial;
  std::vector<ArmHypothesis> arms;
};

class Selection {
 public:
  Selection(const ArmHypothesis& start, ActuationKind kind, std::span<const MotionRecord> records,
            const std::vector<Fold>& folds, const SelectionOptions& options)
      : start_(start), kind_(kind), records_(records), folds_(folds), options_(options) {
    double rms = 0.0;
    for (const MotionRecord& record : records) rms = std::max(rms, motion_rms(record.u_rad));
    if (start_.slip_springs.empty())
      for (const double radius : kRadii) start_.slip_springs.push_back({radius * rms, 0.0});
  }

  SelectedModel run(const FitChoice& plain) {
    SelectedModel out;
    out.choice = given_ = plain;
    out.prior = options_.identify.refinement.prior;
    Attempt best = attempt("plain", out.choice, out.prior, nullptr);
    best.trial.kept = true;
    out.trials.push_back(best.trial);
    if (!std::isfinite(best.trial.unseen))
      throw std::runtime_error("the plain model has no bounded response to these records");
    const auto consider = [&](const char* name, const FitChoice& choice, double prior) {
      Attempt tried = attempt(name, choice, prior, &best);
      tried.trial.kept = tried.trial.unseen < (1.0 - options_.least_gain) * best.trial.unseen;
      out.trials.push_back(tried.trial);
      if (!tried.trial.kept) return;
      out.choice = choice;
      out.prior = prior;
      best = std::move(tried);
    };
    if (plain.elongation) {
      add_best(out, best);
    } else {
      for (const Term& term : kOfBend)
        if (applies(term, out.choice)) consider(term.name, with(out.choice, term), out.prior);
      revise(out, best);
    }
    const double given = out.prior;
    if (given > 0.0)
      for (const double part : kPriors)
        consider(fmt::format("prior of {:.0f} %", 100.0 * part * given).c_str(), out.choice,
                 part * given);
    const ParameterSet set(start_, kind_, out.choice);
    out.whole = find(set, records_, out.prior, best.arms);
    out.arm = set.arm(out.whole.x);
    out.by_fold = std::move(best.arms);
    return out;
  }

 private:
  bool applies(const Term& term, const FitChoice& choice) const {
    if (choice.*term.flag) return false;
    if (term.flag == &FitChoice::venting) return !choice.chamber_lags;
    if (term.flag == &FitChoice::one_saturation) return !choice.saturation;
    if (term.flag == &FitChoice::second_remanence) return choice.remanence;
    return term.flag != &FitChoice::cross || start_.arm.size() > 1;
  }

  static FitChoice with(FitChoice choice, const Term& term) {
    choice.*term.flag = true;
    return choice;
  }
  static FitChoice without(FitChoice choice, const Term& term) {
    choice.*term.flag = false;
    return choice;
  }

  /// Whether the model would be another without a term that it has.
  static bool counts(const Term& term, const FitChoice& choice) {
    if (term.flag == &FitChoice::one_saturation) return !choice.saturation;
    if (term.flag == &FitChoice::venting) return !choice.chamber_lags;
    return term.flag != &FitChoice::remanence || !choice.second_remanence;
  }

  /// What a term is worth depends on those that came later: goes round again, leaves out what no
  /// longer helps and adds what now does, until a round has changed nothing.
  void revise(SelectedModel& out, Attempt& best) {
    int unchanged = 0;
    for (int k = 0; k < kRevisions * static_cast<int>(std::size(kOfBend)); ++k) {
      const Term& term = kOfBend[static_cast<std::size_t>(k) % std::size(kOfBend)];
      if (++unchanged > static_cast<int>(std::size(kOfBend))) return;
      const bool there = out.choice.*term.flag;
      if (there ? !counts(term, out.choice) || given_.*term.flag : !applies(term, out.choice))
        continue;
      const FitChoice choice = there ? without(out.choice, term) : with(out.choice, term);
      Attempt tried =
          attempt((there ? "without " : "") + std::string(term.name), choice, out.prior, &best);
      const double most = (there ? 1.0 : 1.0 - options_.least_gain) * best.trial.unseen;
      tried.trial.kept = tried.trial.unseen <= most;
      out.trials.push_back(tried.trial);
      if (!tried.trial.kept) continue;
      out.choice = choice;
      best = std::move(tried);
      unchanged = 0;
    }
  }

  /// Again and again the best of the terms of the elongation that are left, as long as it gains.
  void add_best(SelectedModel& out, Attempt& best) {
    for (;;) {
      std::vector<Attempt> tried;
      std::vector<FitChoice> choices;
      for (const Term& term : kOfElongation) {
        if (!applies(term, out.choice)) continue;
        choices.push_back(with(out.choice, term));
        tried.push_back(attempt(term.name, choices.back(), out.prior, &best));
      }
      std::size_t least = 0;
      for (std::size_t i = 1; i < tried.size(); ++i)
        if (!std::isfinite(tried[least].trial.unseen) ||
            tried[i].trial.unseen < tried[least].trial.unseen)
          least = i;
      const bool gains = !tried.empty() && tried[least].trial.unseen <
                                               (1.0 - options_.least_gain) * best.trial.unseen;
      if (!gains) {
        for (const Attempt& each : tried) out.trials.push_back(each.trial);
        return;
      }
      tried[least].trial.kept = true;
      out.trials.push_back(tried[least].trial);
      out.choice = choices[least];
      best = std::move(tried[least]);
    }
  }

  Refinement find(const ParameterSet& set, std::span<const MotionRecord> records, double prior,
                  const std::vector<ArmHypothesis>& near) const {
    IdentifyOptions options = options_.identify;
    options.refinement.prior = prior;
    options.refinement.least_gain = std::max(kLeastGain, options.refinement.least_gain);
    options.near.insert(options.near.end(), near.begin(), near.end());
    return identify(set, records, options);
  }

  Attempt attempt(const std::string& name, const FitChoice& choice, double prior,
                  const Attempt* simpler) const {
    if (options_.progress) options_.progress(name);
    const auto begin = std::chrono::steady_clock::now();
    const ParameterSet set(start_, kind_, choice);
    Attempt out;
    out.trial.name = name;
    out.trial.parameters = set.size();
    double squares = 0.0, count = 0.0;
    for (std::size_t i = 0; i < folds_.size(); ++i) {
      std::vector<ArmHypothesis> near;
      if (simpler != nullptr) near.push_back(simpler->arms[i]);
      double rms = std::numeric_limits<double>::quiet_NaN();
      try {
        const Refinement fit = find(set, folds_[i].seen, prior, near);
        out.arms.push_back(set.arm(fit.x));
        const Refinement unseen = predict(set, folds_[i].unseen, fit.x);
        rms = unseen.rms_rad;
        const auto samples = static_cast<double>(unseen.time_s.size());
        squares += samples * rms * rms;
        count += samples;
      } catch (const std::runtime_error&) {
        if (out.arms.size() == i) out.arms.push_back(simpler ? simpler->arms[i] : start_);
        squares = std::numeric_limits<double>::quiet_NaN();
      }
      out.trial.unseen_of.push_back(rms);
    }
    out.trial.unseen = std::sqrt(squares / count);
    out.trial.seconds =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    return out;
  }

  ArmHypothesis start_;
  FitChoice given_;  ///< asked for: stays
  ActuationKind kind_;
  std::span<const MotionRecord> records_;
  const std::vector<Fold>& folds_;
  const SelectionOptions& options_;
};

}  // namespace

std::vector<Fold> halves(const MotionRecord& record) {
  const double begin_s = std::max(record.scored_from_s, record.time_s[0]);
  const double end_s = record.time_s[record.time_s.size() - 1] + 1e-6;
  const double middle_s = 0.5 * (begin_s + end_s);
  const MotionRecord first = record.part(begin_s, middle_s, begin_s - record.time_s[0]);
  const MotionRecord second = record.part(middle_s, end_s, middle_s - record.time_s[0]);
  return {{{first}, second}, {{second}, first}};
}

std::vector<Fold> folds_of(std::span<const MotionRecord> records) {
  if (records.size() == 1) return halves(records.front());
  std::vector<Fold> out;
  for (std::size_t i = 0; i < records.size(); ++i) {
    Fold fold{{}, records[i]};
    for (std::size_t k = 0; k < records.size(); ++k)
      if (k != i) fold.seen.push_back(records[k]);
    out.push_back(std::move(fold));
  }
  return out;
}

void bend_as_predicted(const SelectedModel& bend, std::vector<Fold>& folds) {
  for (std::size_t i = 0; i < folds.size(); ++i) {
    const ResponseModel model(folds[i].unseen);
    Eigen::MatrixXd u;
    const ArmHypothesis& arm = bend.by_fold[i];
    if (!model.simulate(arm, model.longest_step_s(arm), u)) u.setZero();
    folds[i].unseen.u_rad = u;
  }
}

SelectedModel select_terms(const ArmHypothesis& start, ActuationKind kind, const FitChoice& plain,
                           std::span<const MotionRecord> records, const std::vector<Fold>& folds,
                           const SelectionOptions& options) {
  if ((plain.inertia && !plain.elongation) || !(options.apart_s > 0.0))
    return Selection(start, kind, records, folds, options).run(plain);
  const auto thinned = [&](const MotionRecord& record) {
    MotionRecord out = record.thinned(options.apart_s);
    out.input = record.input.averaged(0.5 * options.apart_s);
    return out;
  };
  std::vector<MotionRecord> few;
  for (const MotionRecord& each : records) few.push_back(thinned(each));
  std::vector<Fold> few_folds;
  for (const Fold& fold : folds) {
    few_folds.push_back({{}, thinned(fold.unseen)});
    for (const MotionRecord& each : fold.seen) few_folds.back().seen.push_back(thinned(each));
  }
  return Selection(start, kind, few, few_folds, options).run(plain);
}

std::string selection_text(const SelectedModel& model, double motion, double unit,
                           const char* unit_name) {
  std::string text = fmt::format(
      "rms error on motion not seen, predicted from the input alone, in {}; the motion's own about "
      "its mean: {:.2f}\n{:<26}{:>10}{:>10}{:>10}  {}\n",
      unit_name, unit * motion, "term", "unknowns", "unseen", "gain", "of every part");
  double best = model.trials.front().unseen;
  for (const TermTrial& trial : model.trials) {
    if (!std::isfinite(trial.unseen)) {
      text += fmt::format("{:<26}{:>10}  no bounded response\n", trial.name, trial.parameters);
      continue;
    }
    std::string parts;
    for (const double each : trial.unseen_of) parts += fmt::format("{:8.2f}", unit * each);
    text += fmt::format("{:<26}{:>10}{:>10.2f}{:>9.1f}%{}  {}\n", trial.name, trial.parameters,
                        unit * trial.unseen, 100.0 * (best - trial.unseen) / best, parts,
                        trial.kept ? "kept" : "left out");
    if (trial.kept) best = trial.unseen;
  }
  return text;
}

}  // namespace softarm
