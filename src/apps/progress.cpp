#include "apps/progress.hpp"

#include <unistd.h>

#include "apps/program.hpp"
#include "softarm/base/clock.hpp"

namespace softarm {
namespace {

constexpr long long kTerminalPeriod_ns = 200'000'000;
constexpr long long kLinePeriod_ns = 5'000'000'000;

}  // namespace

Progress::Progress(bool always) : terminal_(isatty(STDERR_FILENO) != 0), always_(always) {}

Progress::~Progress() {
  if (terminal_) draw("\r\033[K", "");
}

bool Progress::due() const {
  if (!terminal_ && !always_) return false;
  return monotonic_now_ns() - last_ns_ >= (terminal_ ? kTerminalPeriod_ns : kLinePeriod_ns);
}

void Progress::update(const std::string& text) {
  if (!due()) return;
  last_ns_ = monotonic_now_ns();
  draw(terminal_ ? "\r\033[K" : "", text + (terminal_ ? "" : "\n"));
}

}  // namespace softarm
