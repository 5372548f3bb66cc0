#include "dev/bench/recordings_bench.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <optional>
#include <stdexcept>

#include "dev/bench/recordings_score.hpp"
#include "dev/bench/temporary_folder.hpp"
#include "softarm/base/output_file.hpp"
#include "softarm/commissioning/identification/log_record.hpp"
#include "softarm/commissioning/identification/residual_parts.hpp"
#include "softarm/commissioning/identification/tip_prediction.hpp"
#include "softarm/config/load.hpp"
#include "softarm/recording/recording_import.hpp"

namespace softarm {
namespace {

namespace fs = std::filesystem;

constexpr double kApart_s = 0.05, kWindow_s = 1.0, kLead_s = 10.0;
constexpr int kMostRounds = 120;
constexpr double kCycle_s = 10.0, kCycleWithin_s = 0.3;

/// Today's terms of `softarm identify --compare`, for comparison.
FitChoice plain_choice() {
  FitChoice plain;
  plain.stiffness = plain.inertia = plain.lag = plain.delay = false;
  plain.directions = true;
  return plain;
}
FitChoice four_terms() {
  FitChoice all = plain_choice();
  all.rest = all.lag = all.delay = all.cubic = true;
  return all;
}

/// All that predicts u and the tip.
struct Found {
  std::string model;
  Eigen::Index parameters = 0;
  double seconds = 0.0;
  bool converged = true;
  ArmHypothesis arm;               ///< without an elongation: lengths as configured
  std::optional<ChordMap> chords;  ///< none: chords of constant curvature
};

/// One recording, imported and read.
struct Loaded {
  ArenaRecording recording;
  Experiment experiment;
  MotionRecord record;
  bool cycles = false;
};

class Arena {
 public:
  Arena(const ArenaOptions& options, const std::function<void(const std::string&)>& progress)
      : options_(options), progress_(progress) {}

  ArenaReport run() {
    std::vector<ArenaRecording> known = known_recordings();
    for (const ArenaRecording& each : partners(known)) known.push_back(each);
    for (const ArenaRecording& each : known)
      if (each.partner_of.empty()) identify_one(each, known);
    return std::move(report_);
  }

 private:
  /// Files that are not known, by the columns of one that is.
  std::vector<ArenaRecording> partners(const std::vector<ArenaRecording>& known) {
    std::vector<fs::path> files;
    for (const auto& entry : fs::directory_iterator(options_.data))
      if (entry.path().extension() == ".csv") files.push_back(entry.path());
    std::sort(files.begin(), files.end());
    std::vector<ArenaRecording> out;
    for (const fs::path& file : files) {
      const auto same_file = [&](const ArenaRecording& it) { return it.table == file.filename(); };
      if (std::any_of(known.begin(), known.end(), same_file)) continue;
      std::optional<ArenaRecording> found;
      for (const ArenaRecording& each : known) {
        if (found || !each.partner_of.empty()) continue;
        try {
          read_mapped_table(file, options_.config / "recordings" / each.map);
        } catch (const std::exception&) {
          continue;  // other columns
        }
        found = each;
      }
      if (!found) {
        report_.skipped.push_back(
            fmt::format("{}: its columns are those of no known recording", file.string()));
        continue;
      }
      found->partner_of = found->name;
      found->name = file.stem().string();
      found->table = file.filename().string();
      out.push_back(*found);
    }
    return out;
  }

  std::optional<Loaded> load(const ArenaRecording& recording, const ArenaRecording& main) {
    const fs::path table = options_.data / recording.table;
    if (!fs::exists(table)) {
      report_.skipped.push_back(fmt::format("{}: no such file, skipped", table.string()));
      return std::nullopt;
    }
    try {
      Loaded out{recording, load_experiment(options_.config / recording.experiment), {}, false};
      const fs::path log = folder_.path() / "log";
      const MappedTable mapped =
          read_mapped_table(table, options_.config / "recordings" / recording.map);
      const MarkerFrames frames = marker_frames(
          read_mapped_table(options_.data / main.table, options_.config / "recordings" / main.map));
      import_recording(mapped, frames, log);
      out.record = read_log(out.experiment, log, LoggedInput::measured).record;
      out.record.scored_from_s = std::max(out.record.scored_from_s, recording.skip_s);
      out.record = out.record.thinned(kApart_s);
      out.cycles = std::abs(repeats_s(out.record) - kCycle_s) < kCycleWithin_s;
      return out;
    } catch (const std::exception& error) {
      report_.skipped.push_back(fmt::format("{}: {}", table.string(), error.what()));
      return std::nullopt;
    }
  }

  static double repeats_s(const MotionRecord& record) {
    return input_period_s(record.input, record.scored_from_s,
                          record.time_s[record.time_s.size() - 1]);
  }

  void identify_one(const ArenaRecording& main, const std::vector<ArenaRecording>& known) {
    if (main.name.find(options_.only) == std::string::npos) return;
    const std::optional<Loaded> loaded = load(main, main);
    if (!loaded) return;
    std::vector<Loaded> others;
    for (const ArenaRecording& each : known)
      if (each.partner_of == main.name)
        if (std::optional<Loaded> other = load(each, main)) others.push_back(std::move(*other));
    const auto simplest = try_choice(*loaded, others, "(16): gains, beta", plain_choice(), {});
    try_choice(*loaded, others, "(16) + all four", four_terms(), simplest);
    choose(*loaded, others);
  }

  IdentifyOptions search(const std::string& what) const {
    IdentifyOptions options;
    options.window_s = kWindow_s;
    options.refinement.prior = 1.0;
    options.refinement.weighted = false;
    options.refinement.most_rounds = kMostRounds;
    options.refinement.threads = options_.threads;
    options.refinement.progress = [this, what](const std::string& text) {
      progress_(fmt::format("{}: {}", what, text));
    };
    return options;
  }

  /// One fixed choice, without lengths and chords. The search may start from what `simpler` found
  /// in the same part, and returns what it found in each.
  std::vector<ArmHypothesis> try_choice(const Loaded& loaded, const std::vector<Loaded>& others,
                                        const std::string& name, const FitChoice& choice,
                                        const std::vector<ArmHypothesis>& simpler) {
    const ParameterSet set(configured(loaded.experiment), loaded.experiment.actuation.kind, choice);
    const std::vector<Fold> folds = todays_halves(loaded.record);
    std::vector<Found> found;
    std::vector<ArmHypothesis> arms;
    for (const MotionRecord* seen : {&loaded.record, &folds[0].seen[0], &folds[1].seen[0]}) {
      IdentifyOptions options = search(loaded.recording.name + ", " + name);
      if (!simpler.empty()) options.near.push_back(simpler[found.size()]);
      const auto begin = std::chrono::steady_clock::now();
      const Refinement fit = identify(set, *seen, options);
      found.push_back({name, set.size(), since(begin), fit.converged, set.arm(fit.x), {}});
      arms.push_back(found.back().arm);
    }
    report(loaded, others, found[0], {found[1], found[2]}, folds);
    return arms;
  }

  /// As `softarm identify --compare` cuts: the second half is simulated from 10 s before it.
  static std::vector<Fold> todays_halves(const MotionRecord& record) {
    std::vector<Fold> folds = halves(record);
    MotionRecord& second = folds[0].unseen;
    second = second.part(second.scored_from_s, 1e9, kLead_s);
    folds[1].seen[0] = second;
    return folds;
  }

  /// Terms chosen by what was not seen.
  void choose(const Loaded& loaded, const std::vector<Loaded>& others) {
    const std::vector<Fold> folds = halves(loaded.record);
    const std::span<const MotionRecord> all(&loaded.record, 1);
    const std::string& name = loaded.recording.name;
    SelectionOptions options;
    options.identify = search(name);
    options.progress = [&](const std::string& text) {
      progress_(fmt::format("{}: {}", name, text));
    };
    const auto begin = std::chrono::steady_clock::now();
    const auto [bend, lengths] =
        select_arm(configured(loaded.experiment), loaded.experiment.actuation.kind, plain_choice(),
                   {loaded.record}, folds, options);
    const Found whole{"chosen",     bend.whole.x.size() + lengths.whole.x.size(),
                      since(begin), bend.whole.converged,
                      bend.arm,     fit_chords(all)};
    std::vector<Found> parts;
    for (std::size_t i = 0; i < folds.size(); ++i) {
      Found part = whole;
      part.arm = bend.by_fold[i];
      part.chords = fit_chords(folds[i].seen);
      parts.push_back(part);
    }
    report(loaded, others, whole, parts, folds);
    report_.choices.push_back({name, bend, lengths});
  }

  static double since(std::chrono::steady_clock::time_point begin) {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  }

  void report(const Loaded& loaded, const std::vector<Loaded>& others, const Found& whole,
              const std::vector<Found>& parts, const std::vector<Fold>& folds) {
    add(loaded, "whole", whole, loaded.record);
    add(loaded, "second by first", parts[0], folds[0].unseen);
    add(loaded, "first by second", parts[1], folds[1].unseen);
    for (const Loaded& other : others)
      add(other, "by " + loaded.recording.name, whole, other.record);
  }

  void add(const Loaded& of, const std::string& what, const Found& found,
           const MotionRecord& record) {
    ArenaRow row{of.recording.name, found.model,    what, found.parameters, {},
                 found.seconds,     found.converged};
    const ResponseModel model(record);
    Eigen::MatrixXd u, length(record.time_s.size(), of.experiment.arm.size());
    if (!model.simulate(found.arm, model.step_s(found.arm).value_or(1e-3), u)) {
      row.score.u_rad = std::numeric_limits<double>::quiet_NaN();
      report_.rows.push_back(row);
      return;
    }
    for (Eigen::Index i = 0; i < length.cols(); ++i)
      length.col(i).setConstant(of.experiment.arm.segments[static_cast<std::size_t>(i)].length_m);
    if (found.arm.elongation.given()) model.simulate_lengths(found.arm, u, length);
    const Eigen::MatrixXd bend = found.chords ? found.chords->bend_rad(u) : u;
    const Eigen::MatrixX3d tip = tips_m(u, chords_m(bend, length));
    const Eigen::Index frames =
        (record.time_s.array() >= record.scored_from_s).count();  // ascending
    row.score = score(record.time_s.tail(frames), record.u_rad.bottomRows(frames),
                      u.bottomRows(frames), tips_m(record.u_rad, record.chord_m).bottomRows(frames),
                      tip.bottomRows(frames), of.cycles);
    report_.rows.push_back(row);
    if (!options_.out.empty() && found.chords && what != "whole")
      write_motion(row, record.time_s.tail(frames), record.u_rad.bottomRows(frames),
                   u.bottomRows(frames), tips_m(record.u_rad, record.chord_m).bottomRows(frames),
                   tip.bottomRows(frames));
  }

  /// Time, then u of all segments and the tip, measured and predicted.
  void write_motion(const ArenaRow& row, const Eigen::VectorXd& time_s,
                    const Eigen::MatrixXd& measured_rad, const Eigen::MatrixXd& predicted_rad,
                    const Eigen::MatrixX3d& measured_m, const Eigen::MatrixX3d& predicted_m) const {
    fs::create_directories(options_.out);
    std::string name = row.recording + "_" + row.what + ".csv";
    std::replace(name.begin(), name.end(), ' ', '_');
    std::string text = "time_s";
    for (const char* kind : {"measured", "predicted"}) {
      for (Eigen::Index c = 0; c < measured_rad.cols(); ++c)
        text += fmt::format(",{}_u{}_{}_rad", kind, c / 2 + 1, c % 2 == 0 ? "x" : "y");
      for (const char* axis : {"x", "y", "z"}) text += fmt::format(",{}_tip_{}_m", kind, axis);
    }
    for (Eigen::Index k = 0; k < time_s.size(); ++k) {
      text += fmt::format("\n{:.4f}", time_s[k]);
      for (const auto* u : {&measured_rad, &predicted_rad}) {
        for (Eigen::Index c = 0; c < u->cols(); ++c) text += fmt::format(",{:.6g}", (*u)(k, c));
        const Eigen::MatrixX3d& tip = u == &measured_rad ? measured_m : predicted_m;
        for (Eigen::Index c = 0; c < 3; ++c) text += fmt::format(",{:.6g}", tip(k, c));
      }
    }
    OutputFile file(options_.out / name, {}, OutputFile::Kind::document);
    file.write(text + "\n");
    file.commit();
  }

  const ArenaOptions& options_;
  const std::function<void(const std::string&)>& progress_;
  TemporaryFolder folder_;
  ArenaReport report_;
};

}  // namespace

std::vector<ArenaRecording> known_recordings() {
  return {
      {"circle", "four_columns_circle.csv", "circle_map.yaml", "recorded_circle.yaml", 6.0, ""},
      {"sine", "one_column_sine.csv", "sine_map.yaml", "recorded_circle.yaml", 6.0, ""},
      {"triangle", "four_columns_triangle.csv", "triangle_map.yaml", "recorded_circle.yaml", 6.0,
       ""},
      {"turns", "two_segments_turns.csv", "turns_map.yaml", "recordings/two_segments_arm.yaml", 0.0,
       ""},
      {"one by one", "two_segments_one_by_one.csv", "one_by_one_map.yaml",
       "recordings/two_segments_arm.yaml", 0.0, "turns"},
      {"tendons", "three_segments_tendons.csv", "tendons_map.yaml",
       "recordings/three_segments_arm.yaml", 2.0, ""},
  };
}

ArenaReport run_arena(const ArenaOptions& options,
                      const std::function<void(const std::string&)>& progress) {
  return Arena(options, progress).run();
}

}  // namespace softarm
