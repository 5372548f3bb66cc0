// Requests that could pressurise the arm must come from somebody who sees it now.
#pragma once

#include <cstdint>
#include <random>

namespace softarm {

/// Numbers that a status carries and that a request has to echo: one that was recorded, queued or
/// meant for another run of the daemon echoes none that is accepted. They count the daemon's
/// microseconds from a start that is random in every run, so that none has to be remembered. That
/// is no secret: it protects from accidents, not from an attacker.
class NonceClock {
 public:
  /// A nonce is accepted for this long.
  static constexpr std::int64_t kAccepted_us = 1'000'000;

  NonceClock() {
    std::random_device random;
    start_ = std::uint64_t{random()} << 32 | random();
  }

  /// Nonce of the status of this instant.
  std::int64_t at(std::int64_t now_us) const noexcept {
    return static_cast<std::int64_t>(start_ + static_cast<std::uint64_t>(now_us));
  }
  /// The instant of which `nonce` is, if it is ours.
  std::int64_t instant_us(std::int64_t nonce) const noexcept {
    return static_cast<std::int64_t>(static_cast<std::uint64_t>(nonce) - start_);
  }
  /// Whether `nonce` is of an instant in the last second up to now, and not before `since_us`.
  bool accepts(std::int64_t nonce, std::int64_t now_us, std::int64_t since_us) const noexcept {
    const std::int64_t issued_us = instant_us(nonce);
    return issued_us >= since_us && issued_us <= now_us && issued_us > now_us - kAccepted_us;
  }

 private:
  std::uint64_t start_;
};

}  // namespace softarm
