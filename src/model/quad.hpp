// What is done along the two or three coordinates of a segment that stretches, side by side.
#pragma once

#include "model/vec3.hpp"

namespace softarm {

#ifdef __AVX__
using Quad = Lanes;
#else
/// GCC 12 puts a factor of Lanes through the stack to spread it over the four, and then waits for
/// its own store: two to three times the time of two registers by hand. The same numbers.
class Quad {
 public:
  Quad() noexcept = default;
  constexpr Quad(double a, double b, double c, double d) noexcept : low_{a, b}, high_{c, d} {}

  double operator[](int lane) const noexcept {
    double number;
    __builtin_memcpy(
        &number, reinterpret_cast<const char*>(this) + sizeof number * static_cast<unsigned>(lane),
        sizeof number);
    return number;
  }
  Quad operator-() const noexcept { return {-low_, -high_}; }
  template <class S>
  Quad& operator+=(const S& b) noexcept {
    return *this = *this + b;
  }
  template <class S>
  Quad& operator*=(const S& b) noexcept {
    return *this = *this * b;
  }
  friend Quad operator+(const Quad& a, const Quad& b) noexcept {
    return {a.low_ + b.low_, a.high_ + b.high_};
  }
  friend Quad operator-(const Quad& a, const Quad& b) noexcept {
    return {a.low_ - b.low_, a.high_ - b.high_};
  }
  friend Quad operator*(const Quad& a, const Quad& b) noexcept {
    return {a.low_ * b.low_, a.high_ * b.high_};
  }
  friend Quad operator/(const Quad& a, const Quad& b) noexcept {
    return {a.low_ / b.low_, a.high_ / b.high_};
  }
  friend Quad operator+(const Quad& a, double b) noexcept { return {a.low_ + b, a.high_ + b}; }
  friend Quad operator+(double a, const Quad& b) noexcept { return {a + b.low_, a + b.high_}; }
  friend Quad operator-(const Quad& a, double b) noexcept { return {a.low_ - b, a.high_ - b}; }
  friend Quad operator-(double a, const Quad& b) noexcept { return {a - b.low_, a - b.high_}; }
  friend Quad operator*(const Quad& a, double b) noexcept { return {a.low_ * b, a.high_ * b}; }
  friend Quad operator*(double a, const Quad& b) noexcept { return {a * b.low_, a * b.high_}; }
  friend Quad operator/(double a, const Quad& b) noexcept { return {a / b.low_, a / b.high_}; }

 private:
  constexpr Quad(Pair low, Pair high) noexcept : low_(low), high_(high) {}

  Pair low_, high_;
};
#endif

}  // namespace softarm
