// softarm-dev bench plant: the arms, what drives them, and the runs of one integrator through them.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <string>
#include <vector>

#include "simulation/integrator.hpp"
#include "softarm/simulation/plant_system.hpp"
#include "softarm/simulation/settings.hpp"

namespace softarm {

/// free: released at rest from a bend of 0.6 rad a segment, each turned by 0.7 rad against the one
/// before. smooth: from rest under smooth_drive. held: the same drive sampled every millisecond and
/// held until the next, so that the torque jumps a thousand times a second.
enum class Scene { free, smooth, held };

struct BenchPlant {
  std::string name;
  PlantSettings settings;
};

/// pcc point and distributed (n = 3), refined (n = 3, 8 pieces), links (4 segments of 6); of
/// distributed mass these once more with segments that stretch.
std::vector<BenchPlant> bench_plants();
/// The paper's arm; of links, that of section VI.
PlantSettings bench_arm(const PlantKind& kind, MassModel mass, bool stretches = false);

/// Generalized force on every segment i (2n, N m): 0.4 k_i (1 - exp(-(t / 0.3 s)^2)) (sin w_i,
/// cos w_i), w_i = 2 pi 0.7 Hz t + i pi / 3. Where segments stretch also the axial force, rising
/// alike, of 30 N (1 + sin w_i), and 3n numbers.
Eigen::VectorXd smooth_drive_nm(const PlantSettings& settings, double t_s);

/// How a run is made. Absolute tolerances are 1e-2 times the relative one in rad, and 10 times it
/// in rad/s, unless given.
struct Trial {
  std::string label;
  IntegratorMethod method = IntegratorMethod::cash4;
  double tolerance = 1e-6;
  double absolute_tolerance = 0.0;  ///< rad; 0: 1e-2 times `tolerance`
  double max_step_s = 0.0;          ///< 0: as the tolerances allow
  bool plain_cvode = false;         ///< CVODE BDF as most would set it up: see PlainCvode
};

inline constexpr double kSample_s = 0.02;

struct PlantRun {
  double seconds = 0.0;                  ///< of processor time
  std::vector<Eigen::VectorXd> samples;  ///< x every kSample_s; empty where it failed
  IntegratorCounters counters;
  std::string failure;
};

PlantRun run_plant(const PlantSettings& settings, Scene scene, const Trial& trial,
                   double duration_s);

/// Largest |x - reference| over all samples; NaN where either failed.
double largest_difference(const PlantRun& run, const PlantRun& reference);

}  // namespace softarm
