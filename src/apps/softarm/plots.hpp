// The plots of a run, drawn by matplotlib in a process of its own.
#pragma once

#include <string>

namespace softarm {

/// Draws everything that the logs in `folder` have data for, beside them. What is missing is said
/// on stderr, not thrown: a run without plots is still a run.
void draw_plots(const std::string& folder);

}  // namespace softarm
