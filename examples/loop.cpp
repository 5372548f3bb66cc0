// The loop against the simulated arm: a frame comes in, a pressure goes out.
// usage: example_loop CONFIG
#include <iostream>
#include <softarm/config/load.hpp>
#include <softarm/runtime/control_pipeline.hpp>
#include <softarm/simulation/simulated_arm.hpp>

int main(int count, char** arguments) try {
  if (count != 2) throw std::invalid_argument("usage: example_loop CONFIG");
  const softarm::Experiment experiment = softarm::load_experiment(arguments[1]);
  softarm::ControlPipeline pipeline(experiment);   // validate, estimate, (17), allocate, limit
  softarm::SimulatedArm arm(experiment.plant, 0);  // or your motion capture and your valves
  std::vector<softarm::MocapFrame> frames;
  for (std::int64_t now_ns = 0; now_ns < 5'000'000'000; now_ns += pipeline.period_ns()) {
    arm.advance_to(now_ns);
    frames.clear();
    for (softarm::MocapFrame frame; arm.receive(frame);) frames.push_back(frame);
    const softarm::TickOutput& output = pipeline.tick({.now_ns = now_ns, .frames = frames});
    arm.command(output.pressure_bar, 100'000'000, now_ns);  // valid for 0.1 s: silence vents
  }
  const Eigen::VectorXd error_rad = pipeline.output().reference.u - arm.plant().u_rad();
  std::cout << "mode: " << softarm::name(pipeline.output().mode)
            << ", largest error of u: " << error_rad.cwiseAbs().maxCoeff() << " rad\n";
} catch (const std::exception& error) {
  std::cerr << error.what() << '\n';
  return 1;
}
