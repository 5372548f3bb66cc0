#include "experiment_log.hpp"

#include <fmt/format.h>

#include <cmath>
#include <fstream>
#include <iterator>
#include <numbers>
#include <stdexcept>

#include "program.hpp"

namespace softarm {
namespace {

constexpr double kThetaForPhi = 0.05;  ///< rad; phi means little below

double angle_difference(double a, double b) {
  return std::remainder(a - b, 2.0 * std::numbers::pi);
}

std::string number(double value) {
  return std::isfinite(value) ? fmt::format("{:.9g}", value) : "null";
}

template <class Range>
std::string list(const Range& values) {
  std::string text = "[";
  for (const double value : values) text += (text.size() > 1 ? ", " : "") + number(value);
  return text + "]";
}

}  // namespace

double TrackingSummary::MeanSquare::rms() const {
  return count > 0 ? std::sqrt(sum / static_cast<double>(count))
                   : std::numeric_limits<double>::quiet_NaN();
}

TrackingSummary::TrackingSummary(int segments, double tracking_from_s)
    : segments_(segments),
      tracking_from_s_(tracking_from_s),
      u_of_segment_(static_cast<std::size_t>(segments)),
      theta_(static_cast<std::size_t>(segments)),
      phi_(static_cast<std::size_t>(segments)) {}

void TrackingSummary::add(const LogRow& row, double period_s) {
  if (ticks_++ == 0) first_t_s_ = row.t_s;
  last_t_s_ = row.t_s + period_s;
  mode_s_[static_cast<std::size_t>(row.mode)] += period_s;
  if (row.commanded.size() > 0)
    pressure_max_bar_ = std::max(pressure_max_bar_, row.commanded.maxCoeff());
  if (row.mode != Mode::active) {
    active_since_s_ = std::numeric_limits<double>::quiet_NaN();
    return;
  }
  ++active_ticks_;
  if (row.saturated) ++saturated_ticks_;
  if (std::isnan(active_since_s_)) active_since_s_ = row.t_s;
  if (row.t_s - active_since_s_ >= tracking_from_s_) add_tracking(row);
}

void TrackingSummary::add_tracking(const LogRow& row) {
  if (row.truth.size() != row.reference.size() || row.truth.size() != 2 * segments_) return;
  for (int i = 0; i < segments_; ++i) {
    const auto index = static_cast<std::size_t>(i);
    const Eigen::Vector2d truth = row.truth.segment<2>(2 * i);
    const Eigen::Vector2d reference = row.reference.segment<2>(2 * i);
    const Eigen::Vector2d error = reference - truth;
    for (const double component : error) {
      u_.add(component);
      u_of_segment_[index].add(component);
    }
    const double largest = error.cwiseAbs().maxCoeff();
    u_max_rad_ = std::isnan(u_max_rad_) ? largest : std::max(u_max_rad_, largest);
    theta_[index].add(reference.norm() - truth.norm());
    if (truth.norm() > kThetaForPhi && reference.norm() > kThetaForPhi)
      phi_[index].add(angle_difference(std::atan2(reference.y(), reference.x()),
                                       std::atan2(truth.y(), truth.x())));
  }
  if (row.tip && row.tip_reference)
    tip_squared_.emplace_back(row.t_s, (*row.tip - *row.tip_reference).squaredNorm());
}

std::string TrackingSummary::json() const {
  std::vector<double> u_segments, theta, phi;
  for (const auto& each : u_of_segment_) u_segments.push_back(each.rms());
  for (const auto& each : theta_) theta.push_back(each.rms());
  for (const auto& each : phi_) phi.push_back(each.rms());
  const double half_s = 0.5 * (first_t_s_ + last_t_s_);
  MeanSquare tip, tip_second_half;
  for (const auto& [t_s, squared] : tip_squared_) {
    tip.sum += squared;
    ++tip.count;
    if (t_s < half_s) continue;
    tip_second_half.sum += squared;
    ++tip_second_half.count;
  }
  std::string modes;
  for (std::size_t k = 0; k < mode_s_.size(); ++k)
    if (mode_s_[k] > 0.0)
      modes += fmt::format("{}\"{}\": {}", modes.empty() ? "" : ", ", name(static_cast<Mode>(k)),
                           number(mode_s_[k]));
  const double saturated =
      active_ticks_ > 0 ? static_cast<double>(saturated_ticks_) / static_cast<double>(active_ticks_)
                        : 0.0;
  return fmt::format(
      "{{\n  \"duration_s\": {},\n  \"ticks\": {},\n  \"tracking\": {{\n    \"u_rms_rad\": {},\n   "
      " \"u_max_rad\": {},\n"
      "    \"u_rms_segment_rad\": {},\n    \"theta_rms_rad\": {},\n    \"phi_rms_rad\": {},\n    "
      "\"tip_rms_m\": {},\n"
      "    \"tip_rms_second_half_m\": {}\n  }},\n  \"pressure_bar\": {{\"max\": {}}},\n  "
      "\"saturated_fraction\": {},\n"
      "  \"modes\": {{{}}}\n}}\n",
      number(ticks_ > 0 ? last_t_s_ - first_t_s_ : 0.0), ticks_, number(u_.rms()),
      number(u_max_rad_), list(u_segments), list(theta), list(phi), number(tip.rms()),
      number(tip_second_half.rms()), number(pressure_max_bar_), number(saturated), modes);
}

std::string TrackingSummary::table() const {
  std::string text = "segment   u rms [mrad]   theta rms [mrad]   phi rms [mrad]\n";
  for (int i = 0; i < segments_; ++i) {
    const auto index = static_cast<std::size_t>(i);
    text += fmt::format("{:>7}   {:>12.3f}   {:>16.3f}   {:>14.3f}\n", i + 1,
                        1e3 * u_of_segment_[index].rms(), 1e3 * theta_[index].rms(),
                        1e3 * phi_[index].rms());
  }
  text += fmt::format("    all   {:>12.3f}   (largest {:.3f} mrad)\n", 1e3 * u_.rms(),
                      1e3 * u_max_rad_);
  text += fmt::format(
      "largest commanded pressure {:.3f} bar; saturated {:.2f} % of {} active ticks\n",
      pressure_max_bar_,
      active_ticks_ > 0
          ? 100.0 * static_cast<double>(saturated_ticks_) / static_cast<double>(active_ticks_)
          : 0.0,
      active_ticks_);
  return text;
}

std::string provenance_line(const Experiment& experiment) {
  return fmt::format("# softarm {} commit {} configuration {:016x} seed {} name {}", version_text(),
                     commit_text(), experiment.hash, experiment.seed, experiment.name);
}

ExperimentLog::ExperimentLog(const std::filesystem::path& folder, const Experiment& experiment)
    : path_(folder / "log.csv"), segments_(experiment.arm.size()) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  file_.reset(std::fopen(path_.c_str(), "w"));
  if (!file_)
    throw std::runtime_error(fmt::format("cannot write {}: choose another --out", path_.string()));

  std::string header = provenance_line(experiment) + "\nt_s,mode,reason,saturated,frame_age_s";
  for (int i = 1; i <= segments_; ++i)
    header += fmt::format(
        ",u{0}_x_rad,u{0}_y_rad,v{0}_x_radps,v{0}_y_radps,ref{0}_x_rad,ref{0}_y_rad,true{0}_x_rad,"
        "true{0}_y_rad,"
        "tau{0}_x_nm,tau{0}_y_nm,twist{0}_rad,length{0}_m",
        i);
  chambers_ = 0;
  for (std::size_t i = 0; i < experiment.actuation.segments.size(); ++i)
    for (std::size_t j = 0; j < experiment.actuation.segments[i].size(); ++j, ++chambers_)
      header += fmt::format(",p{0}_{1}_bar,pm{0}_{1}_bar", i + 1, j + 1);
  header += ",tip_x_m,tip_y_m,tip_z_m,tipref_x_m,tipref_y_m,tipref_z_m\n";
  std::fputs(header.c_str(), file_.get());
}

void ExperimentLog::cell(double value) {
  line_ += ',';
  if (std::isfinite(value)) fmt::format_to(std::back_inserter(line_), "{:.9g}", value);
}

void ExperimentLog::cells(const double* values, int count, int expected) {
  for (int k = 0; k < expected; ++k)
    cell(k < count ? values[k] : std::numeric_limits<double>::quiet_NaN());
}

void ExperimentLog::add(const LogRow& row) {
  line_.clear();
  fmt::format_to(std::back_inserter(line_), "{:.9g},{},{},{}", row.t_s, name(row.mode),
                 name(row.reason), row.saturated ? 1 : 0);
  cell(row.frame_age_s);
  const auto pair = [this](const SegmentVector& v, int i) {
    cells(v.data() + 2 * i, v.size() >= 2 * i + 2 ? 2 : 0, 2);
  };
  const auto single = [this](const SegmentVector& v, int i) {
    cells(v.data() + i, v.size() > i ? 1 : 0, 1);
  };
  for (int i = 0; i < segments_; ++i) {
    for (const SegmentVector* v :
         {&row.u, &row.velocity, &row.reference, &row.truth, &row.tau_actuation})
      pair(*v, i);
    single(row.residual_twist, i);
    single(row.residual_length, i);
  }
  for (int j = 0; j < chambers_; ++j) {
    cells(row.commanded.data() + j, row.commanded.size() > j ? 1 : 0, 1);
    cells(row.real.data() + j, row.real.size() > j ? 1 : 0, 1);
  }
  cells(row.tip ? row.tip->data() : nullptr, row.tip ? 3 : 0, 3);
  cells(row.tip_reference ? row.tip_reference->data() : nullptr, row.tip_reference ? 3 : 0, 3);
  line_ += '\n';
  std::fputs(line_.c_str(), file_.get());
}

void ExperimentLog::close() {
  const bool written = std::fflush(file_.get()) == 0 && std::ferror(file_.get()) == 0;
  file_.reset();
  if (!written)
    throw std::runtime_error(
        fmt::format("could not write all of {}: is the disk full?", path_.string()));
}

std::string timing_json(const TimingReport& report) {
  std::string text =
      fmt::format("{{\n  \"real_time_factor\": {},\n", number(report.real_time_factor));
  std::string histograms;
  for (const auto& each : report.histograms) {
    std::string counts, edges;
    for (int k = 0; k < kDurationBuckets; ++k) {
      counts += fmt::format("{}{}", k > 0 ? ", " : "", each.counts[static_cast<std::size_t>(k)]);
      edges += fmt::format("{}{:.6g}", k > 0 ? ", " : "", bucket_edge_us(k));
    }
    text += fmt::format("  \"{}\": {{\"p50\": {}, \"p99\": {}, \"max\": {}}},\n", each.name,
                        number(quantile_us(each.counts, 0.5)),
                        number(quantile_us(each.counts, 0.99)), number(each.max_us));
    histograms += fmt::format("{}    \"{}\": {{\"edges_us\": [{}], \"counts\": [{}]}}",
                              histograms.empty() ? "" : ",\n", each.name, edges, counts);
  }
  return text + "  \"histograms\": {\n" + histograms + "\n  }\n}\n";
}

void write_text(const std::filesystem::path& path, const std::string& text) {
  std::ofstream file(path);
  file << text << std::flush;
  if (!file)
    throw std::runtime_error(fmt::format("cannot write {}: is the disk full?", path.string()));
}

}  // namespace softarm
