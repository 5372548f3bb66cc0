#include "softarm/commissioning/identification/term_selection.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <map>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <utility>

#include "commissioning/identification/exchange_forecast.hpp"
#include "commissioning/identification/parallel.hpp"

namespace softarm {
namespace {

struct Term {
  const char* name;
  bool FitChoice::*flag;
};

constexpr Term kOfBend[] = {
    {"stiffening by length", &FitChoice::by_length},
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
constexpr int kRevisions = 3;                   ///< rounds over all terms after the first
constexpr int kMostExchanges = 2;
constexpr std::size_t kExchangesTried = 6;    ///< of each order
constexpr double kEqual = 1e-6;               ///< relative; errors that differ by less are equal
constexpr double kSofterBeyond = 1.25;        ///< times the bends that were recorded
constexpr double kRadii[] = {0.3, 1.0, 2.5};  ///< of slip springs, of the motion's RMS

/// RMS of a component of the motion about its mean.
double motion_rms(const Eigen::MatrixXd& rows) {
  const Eigen::RowVectorXd mean = rows.colwise().mean();
  return std::sqrt((rows.rowwise() - mean).squaredNorm() / static_cast<double>(rows.size()));
}

/// One choice in every fold.
struct Attempt {
  FitChoice choice;
  double prior = 1.0;
  TermTrial trial;
  std::vector<ArmHypothesis> arms;
};

/// A model next to another one.
struct Move {
  std::string name;
  FitChoice choice;
  double prior = 1.0;
  const Attempt* near = nullptr;  ///< where its search starts
  const Attempt* also = nullptr;  ///< or here, where that is nearer; may be none
};

int terms_of(const FitChoice& choice) {
  const auto there = [&](const Term& term) { return choice.*term.flag; };
  return static_cast<int>(std::count_if(std::begin(kOfBend), std::end(kOfBend), there)) +
         choice.set + choice.by_bend;
}

class Selection {
 public:
  Selection(const ArmHypothesis& start, ActuationKind kind, std::span<const MotionRecord> records,
            const std::vector<Fold>& folds, const SelectionOptions& options)
      : start_(start), kind_(kind), records_(records), folds_(folds), options_(options) {
    double rms = 0.0;
    for (const MotionRecord& record : records) {
      knows_lengths_ = knows_lengths_ && record.lengths.pressed_m.rows() > 0;
      rms = std::max(rms, motion_rms(record.u_rad));
      for (Eigen::Index i = 0; i < record.u_rad.cols(); i += 2)
        reach_rad_ =
            std::max(reach_rad_, record.u_rad.middleCols<2>(i).rowwise().norm().maxCoeff());
    }
    if (start_.slip_springs.empty())
      for (const double radius : kRadii) start_.slip_springs.push_back({radius * rms, 0.0});
  }

  SelectedModel run(const FitChoice& plain) {
    given_ = plain;
    const double prior = options_.identify.refinement.prior;
    best_ = attempt({"plain", plain, prior}, options_.identify.refinement.threads);
    best_.trial.kept = true;
    trials_.push_back(best_.trial);
    if (!std::isfinite(best_.trial.unseen))
      throw std::runtime_error("the plain model has no bounded response to these records");
    if (plain.elongation) {
      while (keep_best(additions())) {
      }
    } else {
      for (const Term& term : kOfBend)
        if (applies(term, best_.choice)) step(term);
      for (int exchanged = 0; exchanged <= kMostExchanges; ++exchanged) {
        revise();
        if (exchanged == kMostExchanges || !keep_best(exchanges())) break;
      }
    }
    std::vector<Move> priors;
    for (const double part : kPriors)
      if (prior > 0.0)
        priors.push_back({fmt::format("prior of {:.0f} %", 100.0 * part * prior), best_.choice,
                          part * prior, &best_});
    keep_best(priors);
    SelectedModel out;
    out.choice = best_.choice;
    out.prior = best_.prior;
    const ParameterSet set = unknowns(out.choice);
    out.whole = find(set, records_, search_for(out.choice, out.prior), best_.arms);
    out.arm = set.arm(out.whole.x);
    out.by_fold = std::move(best_.arms);
    out.trials = std::move(trials_);
    return out;
  }

 private:
  bool applies(const Term& term, const FitChoice& choice) const {
    if (choice.*term.flag) return false;
    if (term.flag == &FitChoice::venting) return !choice.chamber_lags;
    if (term.flag == &FitChoice::one_saturation) return !choice.saturation;
    if (term.flag == &FitChoice::second_remanence) return choice.remanence;
    if (term.flag == &FitChoice::by_length) return knows_lengths_;
    return term.flag != &FitChoice::cross || start_.arm.size() > 1;
  }

  /// Whether a term may go: it was not asked for, and the model would be another without it.
  bool may_go(const Term& term, const FitChoice& choice) const {
    if (!(choice.*term.flag) || given_.*term.flag) return false;
    if (term.flag == &FitChoice::one_saturation) return !choice.saturation;
    if (term.flag == &FitChoice::venting) return !choice.chamber_lags;
    return term.flag != &FitChoice::remanence || !choice.second_remanence;
  }

  static FitChoice with(FitChoice choice, const Term& term, bool there) {
    choice.*term.flag = there;
    return choice;
  }

  /// What is to be lowered: every term has to be worth `least_gain`. As each move that is kept lowers
  /// it, the search ends.
  double price(const Attempt& it) const {
    return std::log(it.trial.unseen) - terms_of(it.choice) * std::log(1.0 - options_.least_gain);
  }
  bool better(const Attempt& it, const Attempt& than) const {
    if (!std::isfinite(it.trial.unseen)) return false;
    const double gain = price(than) - price(it);
    if (it.prior != than.prior) return gain > -std::log(1.0 - options_.least_gain);
    return gain > kEqual || (gain > -kEqual && it.trial.parameters < than.trial.parameters);
  }

  void keep(Attempt&& it) {
    it.trial.kept = true;
    trials_.push_back(it.trial);
    best_ = std::move(it);
    tried_.clear();
  }

  /// Adds one term, or leaves it out where it is there.
  bool step(const Term& term) {
    const bool there = best_.choice.*term.flag;
    Attempt tried = attempt({(there ? "without " : "") + std::string(term.name),
                             with(best_.choice, term, !there), best_.prior, &best_},
                            options_.identify.refinement.threads);
    if (better(tried, best_)) {
      keep(std::move(tried));
      return true;
    }
    trials_.push_back(tried.trial);
    tried_[term.name] = std::move(tried);
    return false;
  }

  /// What a term is worth depends on those that came later: goes round again, leaves out what no
  /// longer helps and adds what now does, until no step is left that was not tried beside this model.
  void revise() {
    for (int round = 0; round < kRevisions; ++round) {
      bool changed = false;
      for (const Term& term : kOfBend) {
        if (tried_.contains(term.name)) continue;
        if (applies(term, best_.choice) || may_go(term, best_.choice))
          changed = step(term) || changed;
      }
      if (!changed) return;
    }
  }

  std::vector<Move> additions() const {
    std::vector<Move> out;
    for (const Term& term : kOfElongation)
      if (applies(term, best_.choice))
        out.push_back({term.name, with(best_.choice, term, true), best_.prior, &best_});
    return out;
  }

  /// The model with every term that can be taken in.
  FitChoice all_terms() const {
    FitChoice out = best_.choice;
    for (const Term& term : kOfBend)
      if (applies(term, out)) out.*term.flag = true;
    return out;
  }

  using Ranked = std::vector<std::pair<double, Move>>;

  /// The first few of `ranked` that `out` does not have.
  static void append_best(Ranked ranked, std::vector<Move>& out) {
    std::stable_sort(ranked.begin(), ranked.end(),
                     [](const auto& a, const auto& b) { return a.first < b.first; });
    if (ranked.size() > kExchangesTried) ranked.resize(kExchangesTried);
    for (auto& [promise, move] : ranked) {
      const auto same = [&name = move.name](const Move& it) { return it.name == name; };
      if (std::none_of(out.begin(), out.end(), same)) out.push_back(std::move(move));
    }
  }

  /// One term for one or two others, or two at once: those of the best forecast from the sensitivities
  /// of this model, and those that promise most if what single steps did were to add up.
  std::vector<Move> exchanges() const {
    Ranked forecast, added_up;
    std::optional<ParameterSet> all;
    std::optional<ExchangeForecast> sensitivities;
    try {
      all.emplace(unknowns(all_terms()));
      sensitivities.emplace(*all, folds_, best_.arms, best_.prior,
                            options_.identify.refinement.threads);
    } catch (const std::runtime_error&) {
      sensitivities.reset();  // no bounded response next to this model
    }
    for (const Term& in : kOfBend) {
      const auto it = tried_.find(in.name);
      if (!applies(in, best_.choice)) continue;
      const Attempt* const added = it == tried_.end() ? nullptr : &it->second;
      const auto consider = [&](const std::string& name, const FitChoice& choice) {
        if (!sensitivities) return;
        Attempt guess{choice, best_.prior, {}, {}};
        guess.trial.unseen = sensitivities->unseen_rad(unknowns(choice));
        if (std::isfinite(price(guess)))
          forecast.emplace_back(price(guess), Move{name, choice, best_.prior, &best_, added});
      };
      const FitChoice both = with(best_.choice, in, true);
      for (const Term* also = &in + 1; also != std::end(kOfBend); ++also)
        if (applies(*also, both))
          consider(fmt::format("{} and {}", in.name, also->name), with(both, *also, true));
      for (const Term& out : kOfBend) {
        if (&in == &out || !may_go(out, both)) continue;
        const FitChoice one = with(both, out, false);
        const std::string name = fmt::format("{} for {}", in.name, out.name);
        consider(name, one);
        for (const Term* also = &out + 1; also != std::end(kOfBend); ++also)
          if (also != &in && may_go(*also, one))
            consider(fmt::format("{}, {}", name, also->name), with(one, *also, false));
        const auto left = tried_.find(out.name);
        if (added == nullptr || left == tried_.end()) continue;
        const double promise = price(*added) + price(left->second);
        if (std::isfinite(promise))
          added_up.emplace_back(promise, Move{name, one, best_.prior, &best_, added});
      }
    }
    std::vector<Move> out;
    append_best(std::move(forecast), out);
    append_best(std::move(added_up), out);
    return out;
  }

  /// Tries all of them and keeps the best, if it is better than what there is.
  bool keep_best(const std::vector<Move>& moves) {
    const auto count = static_cast<int>(moves.size());
    const int threads = options_.identify.refinement.threads;
    std::vector<Attempt> tried(moves.size());
    in_parallel(count, threads, [&](int i) {
      const auto k = static_cast<std::size_t>(i);
      tried[k] = attempt(moves[k], std::max(1, threads / std::max(1, count)));
    });
    Attempt* found = &best_;
    for (Attempt& each : tried)
      if (better(each, *found)) found = &each;
    for (const Attempt& each : tried)
      if (&each != found) trials_.push_back(each.trial);
    if (found == &best_) return false;
    keep(std::move(*found));
    return true;
  }

  IdentifyOptions search_for(const FitChoice& choice, double prior) const {
    IdentifyOptions out = options_.identify;
    out.refinement.prior = prior;
    out.refinement.near = !choice.elongation;
    out.refinement.least_gain = std::max(kLeastGain, out.refinement.least_gain);
    return out;
  }

  static Refinement find(const ParameterSet& set, std::span<const MotionRecord> records,
                         IdentifyOptions options, const std::vector<ArmHypothesis>& near) {
    options.near.insert(options.near.end(), near.begin(), near.end());
    return identify(set, records, options);
  }

  ParameterSet unknowns(const FitChoice& choice) const {
    ParameterSet out(start_, kind_, choice);
    out.stay_stiff_to(kSofterBeyond * reach_rad_);
    return out;
  }

  /// @param threads  for it; the result does not depend on them
  Attempt attempt(const Move& move, int threads) const {
    report(move.name);
    const auto begin = std::chrono::steady_clock::now();
    const ParameterSet set = unknowns(move.choice);
    Attempt out{move.choice, move.prior, {}, {}};
    out.trial.name = move.name;
    out.trial.parameters = set.size();
    out.trial.unseen_of.assign(folds_.size(), std::numeric_limits<double>::quiet_NaN());
    out.arms.assign(folds_.size(), start_);
    if (move.near != nullptr) out.arms = move.near->arms;
    std::vector<double> samples(folds_.size(), 0.0);
    const auto parts = static_cast<int>(folds_.size());
    IdentifyOptions search = search_for(move.choice, move.prior);
    search.refinement.threads = std::max(1, threads / parts);
    search.refinement.intervals = false;
    search.refinement.progress = [this](const std::string& text) {
      const std::lock_guard lock(reporting_);
      if (options_.identify.refinement.progress) options_.identify.refinement.progress(text);
    };
    in_parallel(parts, threads, [&](int part) {
      const auto i = static_cast<std::size_t>(part);
      std::vector<ArmHypothesis> near;
      for (const Attempt* from : {move.near, move.also})
        if (from != nullptr) near.push_back(from->arms[i]);
      try {
        const Refinement fit = find(set, folds_[i].seen, search, near);
        out.arms[i] = set.arm(fit.x);
        const Refinement unseen = predict(set, folds_[i].unseen, fit.x);
        out.trial.unseen_of[i] = unseen.rms_rad;
        samples[i] = static_cast<double>(unseen.time_s.size());
      } catch (const std::runtime_error&) {
        // no bounded response: the error stays NaN
      }
    });
    double squares = 0.0, count = 0.0;
    for (std::size_t i = 0; i < folds_.size(); ++i) {
      squares += samples[i] * out.trial.unseen_of[i] * out.trial.unseen_of[i];
      count += samples[i];
    }
    out.trial.unseen = std::sqrt(squares / count);
    out.trial.seconds =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    return out;
  }

  void report(const std::string& what) const {
    const std::lock_guard lock(reporting_);
    if (options_.progress) options_.progress(what);
  }

  ArmHypothesis start_;
  FitChoice given_;  ///< asked for: stays
  ActuationKind kind_;
  std::span<const MotionRecord> records_;
  const std::vector<Fold>& folds_;
  const SelectionOptions& options_;
  double reach_rad_ = 0.0;     ///< the farthest recorded bend
  bool knows_lengths_ = true;  ///< that pressures give, in all records
  mutable std::mutex reporting_;
  Attempt best_;
  std::map<std::string, Attempt> tried_;  ///< single steps from `best_` that did not help
  std::vector<TermTrial> trials_;
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

SelectedArm select_arm(const ArmHypothesis& start, ActuationKind kind, const FitChoice& plain,
                       std::vector<MotionRecord> records, std::vector<Fold> folds,
                       const SelectionOptions& options) {
  SelectionOptions of_lengths = options;
  IdentifyOptions& identify = of_lengths.identify;
  identify.refinement.prior = std::max(1.0, identify.refinement.prior);
  FitChoice lengths;
  lengths.elongation = true;
  SelectedArm out;
  out.lengths = select_terms(start, kind, lengths, records, folds, of_lengths);
  const auto press = [](MotionRecord& record, const ArmHypothesis& arm) {
    record.lengths = ResponseModel(record).lengths_of(arm);
  };
  for (MotionRecord& record : records) press(record, out.lengths.arm);
  for (std::size_t i = 0; i < folds.size(); ++i) {
    press(folds[i].unseen, out.lengths.by_fold[i]);
    for (MotionRecord& record : folds[i].seen) press(record, out.lengths.by_fold[i]);
  }
  out.bend = select_terms(start, kind, plain, records, folds, options);
  out.bend.arm.elongation = out.lengths.arm.elongation;
  for (std::size_t i = 0; i < folds.size(); ++i)
    out.bend.by_fold[i].elongation = out.lengths.by_fold[i].elongation;
  return out;
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
