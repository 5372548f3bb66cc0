// Stiffness and damping of an arm from a recorded LCM log. usage: example_identify CONFIG LOG
#include <cstdio>
#include <softarm/commissioning/identification/identify.hpp>
#include <softarm/commissioning/identification/log_record.hpp>
#include <softarm/config/load.hpp>

int main(int count, char** arguments) try {
  if (count != 3) throw std::invalid_argument("usage: example_identify CONFIG LOG");
  const softarm::Experiment experiment = softarm::load_experiment(arguments[1]);
  const softarm::MotionRecord record =
      softarm::read_log(experiment, arguments[2], softarm::LoggedInput::commanded).record;
  const softarm::ParameterSet set(softarm::configured(experiment), experiment.actuation.kind, {});
  const softarm::Refinement fit = softarm::identify(set, record, {});
  for (Eigen::Index i = 0; i < set.size(); ++i)
    std::printf("%s: %.4g +- %.2g %s\n", set[i].name.c_str(), fit.x[i] * set[i].scale,
                fit.half_width(i) * set[i].scale, set[i].unit.c_str());
  std::printf("residual: %.3g mrad rms\n", 1e3 * fit.rms_rad);
} catch (const std::exception& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
