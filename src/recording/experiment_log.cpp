#include "softarm/recording/experiment_log.hpp"

#include <fmt/format.h>

#include <cmath>
#include <iterator>
#include <limits>
#include <nlohmann/json.hpp>

#include "softarm/base/version.hpp"

namespace softarm {
namespace {

constexpr double kNothing = std::numeric_limits<double>::quiet_NaN();  ///< an empty cell

/// Makes the folder if it can; who opens a file in it reports why not.
const std::filesystem::path& made(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  return folder;
}

}  // namespace

std::string provenance_line(const Experiment& experiment) {
  return fmt::format("# softarm {} commit {} configuration {:016x} seed {} name {}", version_text(),
                     commit_text(), experiment.hash, experiment.seed, experiment.name);
}

Files inputs_of(const Experiment& experiment, const Files& more) {
  Files all = experiment.files;
  all.insert(all.end(), more.begin(), more.end());
  return all;
}

SummaryFiles::SummaryFiles(const std::filesystem::path& folder, const Experiment& experiment,
                           const Files& inputs)
    : summary_(made(folder) / "summary.json", inputs_of(experiment, inputs)),
      timing_(folder / "timing.json", inputs_of(experiment, inputs)) {
  constexpr std::size_t kReserved = 64 * 1024;
  summary_.reserve(kReserved);
  timing_.reserve(kReserved);
}

void SummaryFiles::write(const std::string& summary, const std::string& timing) {
  summary_.write(summary);
  summary_.commit();
  timing_.write(timing);
  timing_.commit();
}

ExperimentLog::ExperimentLog(const std::filesystem::path& folder, const Experiment& experiment,
                             const Files& inputs)
    : file_(made(folder) / "log.csv", inputs_of(experiment, inputs), OutputFile::Kind::record),
      segments_(experiment.arm.size()),
      stretches_(experiment.arm.extensible) {
  std::string header = provenance_line(experiment) + "\nt_s,mode,reason,saturated,frame_age_s";
  for (int i = 1; i <= segments_; ++i) {
    header += fmt::format(
        ",u{0}_x_rad,u{0}_y_rad,v{0}_x_radps,v{0}_y_radps,ref{0}_x_rad,ref{0}_y_rad,true{0}_x_rad,"
        "true{0}_y_rad,"
        "tau{0}_x_nm,tau{0}_y_nm,twist{0}_rad,length{0}_m",
        i);
    if (stretches_) header += fmt::format(",e{0}_m,eref{0}_m,etrue{0}_m,axial{0}_n", i);
  }
  chambers_ = 0;
  for (std::size_t i = 0; i < experiment.actuation.segments.size(); ++i)
    for (std::size_t j = 0; j < experiment.actuation.segments[i].size(); ++j, ++chambers_)
      header += fmt::format(",p{0}_{1}_bar,pm{0}_{1}_bar", i + 1, j + 1);
  header += ",tip_x_m,tip_y_m,tip_z_m,tipref_x_m,tipref_y_m,tipref_z_m\n";
  file_.write(header);
}

void ExperimentLog::cell(double value) {
  line_ += ',';
  if (std::isfinite(value)) fmt::format_to(std::back_inserter(line_), "{:.9g}", value);
}

/// Some of a vector's; empty where it has them not.
template <class Values>
void ExperimentLog::cells(const Values& values, Eigen::Index first, Eigen::Index count) {
  const bool there = values.size() >= first + count;
  for (Eigen::Index k = first; k < first + count; ++k) cell(there ? values[k] : kNothing);
}

void ExperimentLog::add(const LogRow& row) {
  line_.clear();
  fmt::format_to(std::back_inserter(line_), "{:.9g},{},{},{}", row.t_s, name(row.mode),
                 name(row.reason), row.saturated ? 1 : 0);
  cell(row.frame_age_s);
  for (int i = 0; i < segments_; ++i) {
    for (const SegmentVector* v :
         {&row.u, &row.velocity, &row.reference, &row.truth, &row.tau_actuation})
      cells(*v, 2 * i, 2);
    cells(row.residual_torsion, i, 1);
    cells(row.residual_length, i, 1);
    if (!stretches_) continue;
    for (const SegmentScalars* v :
         {&row.elongation, &row.elongation_reference, &row.elongation_truth, &row.axial_force})
      cells(*v, i, 1);
  }
  for (int j = 0; j < chambers_; ++j) {
    cells(row.commanded, j, 1);
    cells(row.real, j, 1);
  }
  for (const auto* tip : {&row.tip, &row.tip_reference})
    cells(tip->value_or(Eigen::Vector3d::Constant(kNothing)), 0, 3);
  line_ += '\n';
  file_.write(line_);
}

std::string timing_json(const TimingReport& report) {
  using Json = nlohmann::ordered_json;
  std::vector<double> edges_us;
  for (int k = 0; k < kDurationBuckets; ++k) edges_us.push_back(bucket_edge_us(k));
  Json json{{"real_time_factor", report.real_time_factor}};
  Json histograms = Json::object();
  for (const auto& each : report.histograms) {
    json[each.name] = {{"p50", quantile_us(each.counts, 0.5)},
                       {"p99", quantile_us(each.counts, 0.99)},
                       {"max", each.max_us}};
    histograms[each.name] = {{"edges_us", edges_us}, {"counts", each.counts}};
  }
  json["histograms"] = std::move(histograms);
  return json.dump() + "\n";
}

}  // namespace softarm
