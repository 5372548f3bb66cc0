// A progress line that is redrawn on a terminal; no output elsewhere.
#pragma once

#include <string>

namespace softarm {

class Progress {
 public:
  /// @param always print whole lines every few seconds where there is no terminal, for long
  /// real-time runs
  explicit Progress(bool always = false);
  ~Progress();

  /// Shows `text` instead of what was shown before; rate-limited.
  void update(const std::string& text);

  /// Whether update() would show anything now, to avoid formatting text that is not shown.
  bool due() const;

 private:
  bool terminal_;
  bool always_;
  long long last_ns_ = 0;
};

}  // namespace softarm
