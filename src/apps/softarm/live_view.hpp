// softarm watch on a terminal.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "softarm/config/experiment.hpp"
#include "softarm/recording/status_record.hpp"

namespace softarm {

/// The state of the arm: redrawn in place, and left on the screen at the end.
class LiveView {
 public:
  explicit LiveView(const Experiment& experiment) : experiment_(experiment) {}

  /// Whether there is a terminal, and it is time to draw.
  bool due() const;
  void draw(const StatusRecord& record);

 private:
  static std::string input_text(const ArmStatus& status);
  std::string segment_text(const ArmStatus& status, int segment) const;
  void update_rates(const StatusRecord& record);

  const Experiment& experiment_;
  std::int64_t drawn_ns_ = 0, counted_ns_ = 0, rows_ = 0, frames_ = 0;
  double status_hz_ = 0.0, frames_hz_ = 0.0;
  std::ptrdiff_t lines_ = 0;
};

}  // namespace softarm
