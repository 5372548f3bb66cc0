#include "softarm/model/entire_functions.hpp"

#include "model/entire_series.hpp"

namespace softarm {

std::array<double, kEntireFunctions> entire_functions(double s) noexcept {
  return entire<kEntireFunctions>(s);
}

}  // namespace softarm
