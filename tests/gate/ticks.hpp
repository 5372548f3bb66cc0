// The worst ticks of the control pipeline, counted by callgrind or timed.
#pragma once

namespace softarm {

/// Runs each scene and dumps the counters after every tick of it, labelled tick.OBSERVER.SCENE.n.
void count_ticks();
/// Runs each scene and prints its slowest and its median tick (us).
void time_ticks();

}  // namespace softarm
