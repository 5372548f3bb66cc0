#include "softarm/commissioning/identification/refinement.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <vector>

#include "commissioning/identification/parallel.hpp"
#include "commissioning/identification/serial_correlation.hpp"
#include "softarm/model/modes.hpp"

namespace softarm {
namespace {

constexpr double kHeldAbove = 1.0;  ///< standard error of a combination that is not determined
constexpr double kNoiseFloor_rad = 1e-9;  ///< no motion capture is better
constexpr int kWeightings = 3;
constexpr double kSameWeight = 0.1;    ///< of data beside the prior: the next would change nothing
constexpr double kStillStable = 0.75;  ///< of the longest step, which is short of the stable one
constexpr double kSlowAdvance = 0.3;   ///< steps that shorten less need new sensitivities
constexpr double kNear = 0.02;         ///< sensitivities of a point so near serve for intervals

/// Frames as columns: all components of a frame stand together, records one behind the other.
class Comparison {
 public:
  Comparison(const ParameterSet& set, std::span<const MotionRecord> records)
      : set_(set), records_(records) {
    for (const MotionRecord& record : records) {
      models_.emplace_back(record);
      firsts_.push_back(
          std::lower_bound(record.time_s.begin(), record.time_s.end(), record.scored_from_s) -
          record.time_s.begin());
      const Eigen::Index frames = record.time_s.size() - firsts_.back();
      if (frames < 8)
        throw std::runtime_error(
            fmt::format("{} frames to compare are too few: expected at least 8",
                        std::max<Eigen::Index>(0, frames)));
      frames_ += frames;
    }
  }

  /// The response at `x`, and the step that it took: the longest that is stable straight and at
  /// rest, or, as a bent arm may be faster, a half, a fourth or an eighth of that.
  /// @throws std::runtime_error where none of them gives a bounded response
  double response(const Eigen::VectorXd& x, Eigen::MatrixXd& u) const {
    const double longest_s = models_[0].longest_step_s(set_.arm(x));
    for (const double part : {1.0, 0.5, 0.25, 0.125})
      if (simulate(x, part * longest_s, u)) return part * longest_s;
    throw std::runtime_error(
        "the arm as modelled has no bounded response to this input: check mass, stiffness and "
        "gains of the configuration");
  }

  /// A step that is stable at `x`: the one given as long as it is, so that the response stays a
  /// smooth function of x. Zero where there is none.
  double stable_step_s(const Eigen::VectorXd& x, double step_s) const {
    if (!set_.possible(x)) return 0.0;
    const double longest_s = models_[0].step_s(set_.arm(x)).value_or(0.0);
    return longest_s < kStillStable * step_s ? kStillStable * longest_s : step_s;
  }

  [[nodiscard]] bool simulate(const Eigen::VectorXd& x, double step_s, Eigen::MatrixXd& u) const {
    if (!(step_s > 0.0) || !set_.possible(x)) return false;
    const ArmHypothesis arm = set_.arm(x);
    u.resize(components(), frames_);
    Eigen::MatrixXd all;
    Eigen::Index to = 0;
    for (std::size_t r = 0; r < models_.size(); ++r) {
      if (set_.of_elongation()) {
        models_[r].simulate_lengths(arm, records_[r].u_rad, all);
      } else if (!models_[r].simulate(arm, step_s, all)) {
        return false;
      }
      const Eigen::Index frames = all.rows() - firsts_[r];
      u.middleCols(to, frames) = all.bottomRows(frames).transpose();
      to += frames;
    }
    return u.allFinite();
  }

  [[nodiscard]] bool sensitivities(const Eigen::VectorXd& x, double step_s,
                                   const Eigen::MatrixXd& at, int threads,
                                   Eigen::MatrixXd& J) const {
    J.resize(at.size(), set_.size());
    std::atomic<bool> good = true;
    const Eigen::VectorXd highest = set_.highest();
    in_parallel(static_cast<int>(set_.size()), threads, [&](int i) {
      Eigen::VectorXd moved = x;
      const double difference =
          x[i] + set_[i].difference > highest[i] ? -set_[i].difference : set_[i].difference;
      moved[i] += difference;
      Eigen::MatrixXd u;
      if (!simulate(moved, step_s, u)) {
        good = false;
        return;
      }
      J.col(i) = (u - at).reshaped() / difference;
    });
    return good;
  }

  Eigen::MatrixXd measured() const {
    Eigen::MatrixXd out(components(), frames_);
    Eigen::Index to = 0;
    for (std::size_t r = 0; r < records_.size(); ++r) {
      const Eigen::MatrixXd all =
          set_.of_elongation() ? chord_lengths_m(records_[r]) : records_[r].u_rad;
      const Eigen::Index frames = all.rows() - firsts_[r];
      out.middleCols(to, frames) = all.bottomRows(frames).transpose();
      to += frames;
    }
    return out;
  }
  Eigen::VectorXd times() const {
    Eigen::VectorXd out(frames_);
    Eigen::Index to = 0;
    for (std::size_t r = 0; r < records_.size(); ++r) {
      const Eigen::Index frames = records_[r].time_s.size() - firsts_[r];
      out.segment(to, frames) = records_[r].time_s.tail(frames);
      to += frames;
    }
    return out;
  }

 private:
  Eigen::Index components() const {
    return records_[0].u_rad.cols() / (set_.of_elongation() ? 2 : 1);
  }

  const ParameterSet& set_;
  std::span<const MotionRecord> records_;
  std::vector<ResponseModel> models_;
  std::vector<Eigen::Index> firsts_;  ///< frame to be compared, of every record
  Eigen::Index frames_ = 0;           ///< compared, of all
};

/// L^-1 of the covariance L L' of the columns of `residual`; its mean alone unless `weighted`.
Eigen::MatrixXd whitener(const Eigen::MatrixXd& residual, bool weighted) {
  const Eigen::Index dof = residual.rows();
  if (!weighted) {
    const double squared = residual.squaredNorm() / static_cast<double>(residual.size());
    return Eigen::MatrixXd::Identity(dof, dof) /
           std::sqrt(squared + kNoiseFloor_rad * kNoiseFloor_rad);
  }
  Eigen::MatrixXd covariance =
      residual * residual.transpose() / static_cast<double>(residual.cols());
  covariance.diagonal().array() +=
      1e-3 * covariance.trace() / static_cast<double>(dof) + kNoiseFloor_rad * kNoiseFloor_rad;
  return covariance.llt().matrixL().solve(Eigen::MatrixXd::Identity(dof, dof));
}

/// Multiplies every block of dof rows.
Eigen::MatrixXd whitened(const Eigen::MatrixXd& whiten, const Eigen::MatrixXd& J) {
  Eigen::MatrixXd out(J.rows(), J.cols());
  for (Eigen::Index j = 0; j < J.cols(); ++j)
    out.col(j) = (whiten * J.col(j).reshaped(whiten.rows(), J.rows() / whiten.rows())).reshaped();
  return out;
}

/// One search from one point, with one weighting.
class Search {
 public:
  Search(const Comparison& comparison, const ParameterSet& set, const RefinementOptions& options)
      : comparison_(comparison),
        expected_(set.expected()),
        lowest_(set.lowest()),
        highest_(set.highest()),
        options_(options),
        measured_(comparison.measured()) {}

  /// The response at the x that was found.
  Eigen::MatrixXd run(Refinement& out) {
    Eigen::MatrixXd u;
    step_s_ = comparison_.response(out.x, u);
    double damping = 1e-6;
    for (int weighting = 0; weighting < kWeightings; ++weighting) {
      const double before = whiten_.size() > 0 ? whiten_.squaredNorm() / inflation_ : 0.0;
      whiten_ = whitener(measured_ - u, options_.weighted);
      inflation_ =
          weighting == 0 && !options_.near ? 1.0 : variance_inflation((measured_ - u).transpose());
      const double now = whiten_.squaredNorm() / inflation_;
      if (options_.near && std::abs(now - before) < kSameWeight * before) break;
      out.converged = slow_ = false;
      length_ = std::numeric_limits<double>::infinity();
      while (out.rounds < options_.most_rounds && !out.converged) {
        ++out.rounds;
        if (!improve(out, u, damping)) break;
      }
    }
    if (options_.intervals) finish(out, u);
    return u;
  }

 private:
  double cost(const Eigen::MatrixXd& u, const Eigen::VectorXd& x) const {
    const double prior = options_.prior > 0.0
                             ? (x - expected_).squaredNorm() / (options_.prior * options_.prior)
                             : 0.0;
    return (whiten_ * (measured_ - u)).squaredNorm() / inflation_ + prior;
  }

  /// The total information, and its eigenvectors in descending order.
  void decompose(const Eigen::MatrixXd& J, Refinement& out) const {
    Eigen::MatrixXd information = J.transpose() * J / inflation_;
    if (options_.prior > 0.0)
      information.diagonal().array() += 1.0 / (options_.prior * options_.prior);
    const Modes modes = symmetric_modes(information);
    out.singular_values = modes.values.reverse().cwiseMax(0.0).cwiseSqrt();
    out.combinations = modes.vectors.rowwise().reverse();
    out.held = static_cast<int>((out.singular_values.array() < 1.0 / kHeldAbove).count());
    if (options_.prior > 0.0) out.held = 0;
  }

  /// The sensitivities of an earlier point serve as long as the search advances well with them:
  /// they cost as many simulations as there are parameters.
  bool improve(Refinement& out, Eigen::MatrixXd& u, double& damping) {
    const bool fresh = J_.size() == 0 || slow_;
    if (fresh && !comparison_.sensitivities(out.x, step_s_, u, options_.threads, J_)) return false;
    if (fresh) J_at_ = out.x;
    Eigen::MatrixXd J = whitened(whiten_, J_);
    Eigen::VectorXd gradient = J.transpose() * (whiten_ * (measured_ - u)).reshaped() / inflation_;
    if (options_.prior > 0.0) gradient += (expected_ - out.x) / (options_.prior * options_.prior);
    for (Eigen::Index i = 0; i < out.x.size(); ++i) {
      const bool low = out.x[i] <= lowest_[i] && gradient[i] <= 0.0;
      const bool high = out.x[i] >= highest_[i] && gradient[i] >= 0.0;
      if (!low && !high) continue;
      J.col(i).setZero();  // is at its limit
      gradient[i] = 0.0;
    }
    decompose(J, out);
    const Eigen::VectorXd squares = out.singular_values.array().square();
    Eigen::VectorXd along = out.combinations.transpose() * gradient;
    along.tail(out.held).setZero();
    const double before = cost(u, out.x);
    double promised = 0.0;
    for (int attempt = 0; attempt < 12; ++attempt) {
      const Eigen::VectorXd inverse = (squares.array() + damping * squares.mean()).inverse();
      const Eigen::VectorXd step = out.combinations * along.cwiseProduct(inverse);
      if (!step.allFinite()) return false;
      const double length = along.cwiseProduct(inverse).dot(along);  // in squared standard errors
      const bool small = length < 1e-6 || step.cwiseAbs().maxCoeff() < 1e-10;
      Eigen::MatrixXd tried;
      const Eigen::VectorXd x = (out.x + step).cwiseMax(lowest_).cwiseMin(highest_);
      const double stable_s = comparison_.stable_step_s(x, step_s_);
      if (comparison_.simulate(x, stable_s, tried) && cost(tried, x) <= before) {
        update(x - out.x, tried - u);
        out.x = x;
        u = tried;
        step_s_ = stable_s;
        damping = std::max(1e-12, 0.1 * damping);
        out.converged = small || (fresh && before - cost(u, x) < options_.least_gain);
        slow_ = length > kSlowAdvance * length_;
        length_ = slow_ ? std::numeric_limits<double>::infinity() : length;
        report_progress(out);
        return true;
      }
      if (small) {
        out.converged = true;
        return false;
      }
      if (!fresh) {
        slow_ = true;
        return true;  // with new sensitivities, then
      }
      promised = std::max(promised, length);
      damping = std::max(1e-9, 10.0 * damping);
    }
    out.converged = promised < options_.least_gain;  // recorded inputs have kinks
    return false;
  }

  /// Broyden's update: the sensitivities explain the last step exactly.
  void update(const Eigen::VectorXd& step, const Eigen::MatrixXd& change) {
    const double squared = step.squaredNorm();
    if (!(squared > 0.0)) return;
    J_ += (change.reshaped() - J_ * step) / squared * step.transpose();
  }

  void report_progress(const Refinement& out) const {
    if (options_.progress)
      options_.progress(fmt::format("refining the simulated response, round {}", out.rounds));
  }

  /// Intervals and what the report shows.
  void finish(Refinement& out, const Eigen::MatrixXd& u) {
    const Eigen::MatrixXd residual = measured_ - u;
    whiten_ = whitener(residual, options_.weighted);
    inflation_ = variance_inflation(residual.transpose());
    if ((out.x - J_at_).cwiseAbs().maxCoeff() > kNear &&
        !comparison_.sensitivities(out.x, step_s_, u, options_.threads, J_))
      throw std::runtime_error("the response next to what was found is not bounded");
    const Eigen::MatrixXd J = whitened(whiten_, J_);
    decompose(J, out);

    const Eigen::Index dof = residual.rows(), frames = residual.cols();
    const Eigen::MatrixXd white = whiten_ * residual;
    Eigen::MatrixXd scores(frames, out.x.size());
    for (Eigen::Index k = 0; k < frames; ++k)
      scores.row(k) = white.col(k).transpose() * J.middleRows(k * dof, dof);
    const Eigen::MatrixXd summed = sum_covariance(scores) / (inflation_ * inflation_);
    const Eigen::Index kept = out.x.size() - out.held;
    const Eigen::MatrixXd part = out.combinations.leftCols(kept);
    Eigen::MatrixXd inner = part.transpose() * summed * part;
    if (options_.prior > 0.0) inner.diagonal().array() += 1.0 / (options_.prior * options_.prior);
    const Eigen::VectorXd inverse = out.singular_values.head(kept).array().square().inverse();
    const double samples = static_cast<double>(frames * dof);
    const double freedom = std::max(1.0, samples / inflation_ - static_cast<double>(kept));
    const Eigen::MatrixXd spread = part * inverse.asDiagonal();
    out.covariance = spread * inner * spread.transpose();
    out.covariance *= samples / (samples - static_cast<double>(kept));
    out.quantile = student_975(freedom);
    out.inflation = inflation_;
  }

  const Comparison& comparison_;
  Eigen::VectorXd expected_, lowest_, highest_;
  const RefinementOptions& options_;
  double step_s_ = 0.0;
  Eigen::MatrixXd measured_, whiten_;
  double inflation_ = 1.0;
  Eigen::MatrixXd J_;  ///< not whitened
  Eigen::VectorXd J_at_;
  bool slow_ = false;
  double length_ = std::numeric_limits<double>::infinity();  ///< of the step before
};

void compare(const Comparison& comparison, const Eigen::MatrixXd& u, Refinement& out) {
  const Eigen::MatrixXd measured = comparison.measured();
  const auto samples = static_cast<double>(measured.size());
  out.time_s = comparison.times();
  out.measured_rad = measured.transpose();
  out.residual_rad = (measured - u).transpose();
  out.rms_rad = std::sqrt(out.residual_rad.squaredNorm() / samples);
  const Eigen::RowVectorXd mean = out.measured_rad.colwise().mean();
  out.motion_rms_rad = std::sqrt((out.measured_rad.rowwise() - mean).squaredNorm() / samples);
}

}  // namespace

double Refinement::half_width(Eigen::Index i) const {
  return quantile * std::sqrt(std::max(0.0, covariance(i, i)));
}

Refinement refine(const ParameterSet& set, const MotionRecord& record, const Eigen::VectorXd& start,
                  const RefinementOptions& options) {
  return refine(set, std::span(&record, 1), start, options);
}

Refinement refine(const ParameterSet& set, std::span<const MotionRecord> records,
                  const Eigen::VectorXd& start, const RefinementOptions& options) {
  const Comparison comparison(set, records);
  Refinement out;
  out.x = start.cwiseMax(set.lowest()).cwiseMin(set.highest());
  compare(comparison, Search(comparison, set, options).run(out), out);
  return out;
}

Refinement predict(const ParameterSet& set, const MotionRecord& record, const Eigen::VectorXd& x) {
  const Comparison comparison(set, std::span(&record, 1));
  Refinement out;
  out.x = x;
  Eigen::MatrixXd u;
  comparison.response(x, u);
  compare(comparison, u, out);
  return out;
}

Eigen::MatrixXd sensitivities(const ParameterSet& set, const MotionRecord& record,
                              const Eigen::VectorXd& x, int threads) {
  const Comparison comparison(set, std::span(&record, 1));
  Eigen::MatrixXd u, J;
  if (!comparison.sensitivities(x, comparison.response(x, u), u, threads, J))
    throw std::runtime_error("the response next to these parameters is not bounded");
  return J;
}

}  // namespace softarm
