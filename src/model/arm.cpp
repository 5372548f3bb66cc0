#include "softarm/model/arm.hpp"

#include <numeric>
#include <stdexcept>
#include <string>

namespace softarm {

double ArmParameters::length_m() const {
  return std::accumulate(segments.begin(), segments.end(), 0.0,
                         [](double sum, const auto& segment) { return sum + segment.length_m; });
}

void expect_constant_length(const ArmParameters& arm, const char* who) {
  if (!arm.extensible) return;
  throw std::invalid_argument(std::string(who) +
                              ": expected segments of constant length, got an arm that stretches");
}

}  // namespace softarm
