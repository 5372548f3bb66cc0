#include "softarm/control/reference_kinds.hpp"

#include <fmt/core.h>

#include <cmath>
#include <utility>

namespace softarm {

ReferenceError::ReferenceError(int phase, const std::string& place, std::string expected_text,
                               std::string got_text)
    : std::invalid_argument(fmt::format("reference[{}]{}: expected {}, got {}", phase, place,
                                        expected_text, got_text)),
      key(fmt::format("reference[{}]{}", phase, place)),
      expected(std::move(expected_text)),
      got(std::move(got_text)) {}

void ReferencePlace::require_finite(std::initializer_list<double> values) const {
  for (const double value : values)
    require(std::isfinite(value), "finite numbers", fmt::format("{}", value));
}

ReferenceKind::ReferenceKind() : ReferenceKind(SetPointReference{}) {}

Registry<ReferenceKind>& reference_kinds() {
  static Registry<ReferenceKind> kinds({
      SetPointReference{},
      PaperReference{},
      WayPointReference{},
      LiveReference{},
      LiveTipReference{},
      TableReference{},
      TipPathReference{.shape = TipPathShape::point},
      TipPathReference{.shape = TipPathShape::circle},
      TipPathReference{.shape = TipPathShape::lemniscate},
  });
  return kinds;
}

}  // namespace softarm
