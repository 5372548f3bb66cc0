#include "softarm/model/arm.hpp"

#include <stdexcept>
#include <string>

namespace softarm {

void expect_constant_length(const ArmParameters& arm, const char* who) {
  if (!arm.extensible) return;
  throw std::invalid_argument(std::string(who) +
                              ": expected segments of constant length, got an arm that stretches");
}

}  // namespace softarm
