// The motion-capture sources that are built in, a line each.
#include "softarm/transport/mocap_format.hpp"

namespace softarm {

Registry<MocapSourceKind>& mocap_sources() {
  static Registry<MocapSourceKind> sources({
      softarm_mocap(),
      SOFTARM_KIND_OF_FILE(MocapSourceKind, optitrack_mocap),
      SOFTARM_KIND_OF_FILE(MocapSourceKind, rigid_transform_mocap),
      SOFTARM_KIND_OF_FILE(MocapSourceKind, natnet_mocap),
      SOFTARM_KIND_OF_FILE(MocapSourceKind, qtm_mocap),
  });
  return sources;
}

}  // namespace softarm
