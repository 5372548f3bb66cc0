#include "dev/bench/kdl_chain.hpp"

#include <dlfcn.h>

#include <stdexcept>
#include <vector>

namespace softarm {
namespace {

/// Loaded once, never unloaded; nullptr where there is none.
const KdlPlugin* plugin() {
#ifdef SOFTARM_KDL_PLUGIN
  static const KdlPlugin* const loaded = []() -> const KdlPlugin* {
    void* module = dlopen(SOFTARM_KDL_PLUGIN, RTLD_NOW | RTLD_LOCAL);
    void* symbol = module != nullptr ? dlsym(module, kKdlPluginSymbol) : nullptr;
    return symbol != nullptr ? *static_cast<const KdlPlugin* const*>(symbol) : nullptr;
  }();
  return loaded;
#else
  return nullptr;
#endif
}

const KdlPlugin* expect_plugin() {
  if (plugin() == nullptr) throw std::runtime_error("expected a build with Orocos KDL, got none");
  return plugin();
}

void* make(const KdlPlugin& kdl, const ArmParameters& arm) {
  std::vector<double> length, mass;
  for (const SegmentParameters& segment : arm.segments) {
    length.push_back(segment.length_m);
    mass.push_back(segment.mass_kg);
  }
  const Eigen::Vector3d gravity = arm.base_rotation.transpose() * arm.gravity_mps2;
  return kdl.make(arm.size(), length.data(), mass.data(), gravity.data());
}

}  // namespace

bool KdlChain::available() { return plugin() != nullptr; }

KdlChain::KdlChain(const ArmParameters& arm)
    : plugin_(expect_plugin()), chain_(make(*plugin_, arm), plugin_->destroy) {}

void KdlChain::maps(const Eigen::VectorXd& q, const Eigen::VectorXd& velocity) const {
  plugin_->maps(chain_.get(), q.data(), velocity.data());
}

void KdlChain::matrices(const Eigen::VectorXd& q, const Eigen::VectorXd& velocity,
                        Eigen::MatrixXd& B, Eigen::VectorXd& C_velocity, Eigen::VectorXd& G) const {
  plugin_->matrices(chain_.get(), q.data(), velocity.data(), B.data(), C_velocity.data(), G.data());
}

void KdlChain::inverse_dynamics(const Eigen::VectorXd& q, const Eigen::VectorXd& velocity,
                                const Eigen::VectorXd& acceleration, Eigen::VectorXd& out) const {
  plugin_->inverse_dynamics(chain_.get(), q.data(), velocity.data(), acceleration.data(),
                            out.data());
}

}  // namespace softarm
