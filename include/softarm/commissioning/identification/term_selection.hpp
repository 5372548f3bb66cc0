// Which terms a model of an arm needs, chosen by what it predicts on motion that it has not seen.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "softarm/commissioning/identification/identify.hpp"

namespace softarm {

/// A part to identify from, and one to judge by.
struct Fold {
  std::vector<MotionRecord> seen;
  MotionRecord unseen;
};

/// The halves of the time scored of one record, each judged by the other. Both are simulated from
/// the beginning of the record, so that what remembers knows what was before.
std::vector<Fold> halves(const MotionRecord& record);

/// Several records of one arm with one zero: each is judged by all others. Of one record, its
/// halves.
std::vector<Fold> folds_of(std::span<const MotionRecord> records);

/// A term that was tried.
struct TermTrial {
  std::string name;
  Eigen::Index parameters = 0;    ///< of the model with it
  double unseen = 0.0;            ///< RMS over all folds; rad, or m of an elongation
  std::vector<double> unseen_of;  ///< of every fold
  bool kept = false;
  double seconds = 0.0;  ///< of the searches
};

/// The result of a selection.
struct SelectedModel {
  FitChoice choice;
  double prior = 1.0;                  ///< width of the prior that predicts best
  std::vector<TermTrial> trials;       ///< in order; the first is the plain model
  std::vector<ArmHypothesis> by_fold;  ///< identified in every fold with `choice`
  ArmHypothesis arm;                   ///< identified from all records
  Refinement whole;                    ///< how it fits all of them
};

/// Settings of `select_terms`.
struct SelectionOptions {
  IdentifyOptions identify;
  double least_gain = 0.01;  ///< relative, of the error on what was not seen; less is no gain
  /// Without inertia, frames so far apart are searched with, and measured pressures are averaged over
  /// half of it: a tenth of the shortest lag of such arms.
  double apart_s = 0.1;
  std::function<void(const std::string&)> progress;  ///< may be empty
};

/// Begins with `plain` and adds one term at a time. Of the bend, in the order of the value that they
/// had on real arms: stiffening by length, asymmetric lag, rest, cross-coupling, hysteresis,
/// saturation, lags of every chamber, masses (gravity beside k), remanence, delay, stiffening, cubic
/// stiffness. Of the elongation, which is quick, the best of all that are left each time. What is
/// lowered is log(error on what was not seen) + `least_gain` times the number of terms: a term stays
/// where the error becomes less by `least_gain`. Then all terms of the bend are gone through again, three times
/// at most: one that is not worth that goes, one that now is comes. Where no single step helps, one
/// term is exchanged for one or two others, or two come at once, by `ExchangeForecast` in the order
/// of what the sensitivities promise. At last other widths of the prior are tried. The result does
/// not depend on the number of threads.
/// @param start  what is configured; every segment gets slip springs at radii taken from the motion
/// @throws std::runtime_error as `identify`, of the plain model only
SelectedModel select_terms(const ArmHypothesis& start, ActuationKind kind, const FitChoice& plain,
                           std::span<const MotionRecord> records, const std::vector<Fold>& folds,
                           const SelectionOptions& options);

/// How an arm bends, and how it stretches. The arms of `bend` have the elongation too.
struct SelectedArm {
  SelectedModel bend, lengths;
};

/// First the terms of the lengths, which may follow the measured bend, then those of the bend, whose
/// stiffness may follow the lengths found. What `bend` predicts comes from pressures alone.
/// @param records  with chords. @throws std::runtime_error as `select_terms`
SelectedArm select_arm(const ArmHypothesis& start, ActuationKind kind, const FitChoice& plain,
                       std::vector<MotionRecord> records, std::vector<Fold> folds,
                       const SelectionOptions& options);

/// Every term with its price and its gain, for a person.
std::string selection_text(const SelectedModel& model, double motion, double unit,
                           const char* unit_name);

}  // namespace softarm
