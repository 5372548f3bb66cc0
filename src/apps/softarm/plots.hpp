// The plots of a run, drawn by matplotlib in a separate process.
#pragma once

#include <string>

namespace softarm {

/// Draws every plot that the logs in `folder` have data for, into the same folder. Failures are
/// reported on stderr, not thrown: a run without plots is still a run.
void draw_plots(const std::string& folder);

}  // namespace softarm
