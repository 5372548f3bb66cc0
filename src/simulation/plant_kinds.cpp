// The kinds that are built in, a line each.
#include "softarm/simulation/plant_kinds.hpp"

namespace softarm {

PlantKind::PlantKind() : PlantKind(PccSettings{}) {}

Registry<PlantKind>& plant_kinds() {
  static Registry<PlantKind> kinds({
      PccSettings{},
      RefinedSettings{},
      LinkSettings{},
  });
  return kinds;
}

}  // namespace softarm
