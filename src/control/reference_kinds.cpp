#include "softarm/control/reference_kinds.hpp"

namespace softarm {

ReferenceKind::ReferenceKind() : ReferenceKind(SetPointReference{}) {}

Registry<ReferenceKind>& reference_kinds() {
  static Registry<ReferenceKind> kinds({
      SetPointReference{},
      PaperReference{},
      WayPointReference{},
      LiveReference{},
      TipPathReference{.shape = TipPathShape::point},
      TipPathReference{.shape = TipPathShape::circle},
      TipPathReference{.shape = TipPathShape::lemniscate},
  });
  return kinds;
}

}  // namespace softarm
