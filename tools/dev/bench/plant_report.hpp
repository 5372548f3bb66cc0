// softarm-dev bench plant: what is measured, and how it is printed.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "dev/bench/model_report.hpp"
#include "dev/bench/plant_scenes.hpp"

namespace softarm {

/// One method at one tolerance through one scene.
struct TrialReport {
  std::string plant;
  Scene scene;
  Trial trial;
  double error_rad = 0.0;  ///< largest of any coordinate at any sample; NaN where it failed
  double factor = 0.0;     ///< simulated time over the median processor time
  double rival_ratio =
      0.0;  ///< median over the rounds: plain CVODE's time over this one's; NaN: none
  IntegratorCounters counters;
  std::string failure;
};

/// An arm of `pieces` pieces a segment against one of kManyPieces, under the smooth drive.
struct PiecesReport {
  int pieces;
  double tip_error_m;  ///< largest, against the arm of kManyPieces
  double error_rad;    ///< largest of any segment's u, as its end is turned
  double factor;
};
inline constexpr int kManyPieces = 24;

struct PlantReport {
  BenchBuild build;
  double duration_s = 0.0;  ///< simulated, of every run of pcc; half as much of the others
  int rounds = 0;
  std::vector<TrialReport> trials;
  std::vector<PiecesReport> pieces;
};

PlantReport bench_plant(double duration_s, int rounds,
                        const std::function<void(const std::string&)>& progress);

std::string name(Scene scene);
std::string name(IntegratorMethod method);
std::string table(const PlantReport& report);
std::string json(const PlantReport& report);

}  // namespace softarm
