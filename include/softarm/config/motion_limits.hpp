// How far an arm may move while a tool commands its valves.
// config/template.yaml documents every setting.
#pragma once

namespace softarm {

/// Kept by whatever plays set points on an arm without its daemon: softarm identify --live, check
/// --pulse and jog. Keys of section identification.
struct MotionLimits {
  double max_theta_rad = 1.5;
  double max_speed_radps = 20.0;
};

}  // namespace softarm
