// A trajectory from a table: a cubic spline through its points.
#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "softarm/base/hash.hpp"
#include "softarm/base/table_text.hpp"
#include "softarm/control/reference_kinds.hpp"
#include "softarm/control/settings.hpp"

namespace softarm {

/// The spline: points and second derivatives of every component, row by row. Its first point is at
/// time 0.
class TableCurve {
 public:
  bool tip = false;  ///< x, y, z in m; otherwise u, 2n, rad

  TableCurve(std::vector<double> times_s, std::vector<double> points, bool periodic)
      : times_(std::move(times_s)),
        points_(std::move(points)),
        bends_(points_.size()),
        size_(points_.size() / times_.size()),
        periodic_(periodic) {
    for (std::size_t c = 0; c < size_; ++c) solve(c);
  }

  std::size_t size() const noexcept { return size_; }
  std::size_t points() const noexcept { return times_.size(); }
  double time_s(std::size_t row) const noexcept { return times_[row]; }
  double point(std::size_t row, std::size_t c) const noexcept { return points_[row * size_ + c]; }
  double end_s() const noexcept { return times_.back(); }
  std::uint64_t digest() const noexcept {
    const auto bytes = [](const std::vector<double>& v) { return std::as_bytes(std::span(v)); };
    return fnv1a(bytes(times_)) ^ 31 * fnv1a(bytes(points_));
  }

  /// Calls put(component, value, first derivative, second derivative).
  template <class Put>
  void at(double time_s, const Put& put) const noexcept {
    double time = time_s;
    if (periodic_ && time > end_s()) time = std::fmod(time, end_s());
    const bool rests = time <= 0.0 || time >= end_s();
    time = std::clamp(time, 0.0, end_s());
    const auto next = std::upper_bound(times_.begin() + 1, times_.end() - 1, time);
    const auto i = static_cast<std::size_t>(next - times_.begin()) - 1;
    for (std::size_t c = 0; c < size_; ++c) {
      const auto [value, rate, bend] = piece(i, c, time);
      const bool still = rests && !periodic_;
      put(c, value, still ? 0.0 : rate, still ? 0.0 : bend);
    }
  }

  /// Largest norms over all groups of `group` components that follow one another: of the value, its
  /// first and its second derivative. From the control points of the pieces' quarters, so never
  /// below the true ones and hardly above.
  std::array<double, 3> largest(std::size_t group) const {
    std::array<double, 3> most{};
    for (std::size_t i = 0; i + 1 < times_.size(); ++i)
      for (int quarter = 0; quarter < 4; ++quarter)
        for (std::size_t first = 0; first < size_; first += group)
          widen(i, quarter, first, group, most);
    return most;
  }

 private:
  struct Value {
    double value, rate, bend;
  };

  Value piece(std::size_t i, std::size_t c, double time) const noexcept {
    const double h = times_[i + 1] - times_[i], b = (time - times_[i]) / h, a = 1.0 - b;
    const double y0 = point(i, c), y1 = point(i + 1, c);
    const double m0 = bends_[i * size_ + c], m1 = bends_[(i + 1) * size_ + c];
    return {a * y0 + b * y1 + ((a * a * a - a) * m0 + (b * b * b - b) * m1) * h * h / 6.0,
            (y1 - y0) / h + ((1.0 - 3.0 * a * a) * m0 + (3.0 * b * b - 1.0) * m1) * h / 6.0,
            a * m0 + b * m1};
  }

  void widen(std::size_t i, int quarter, std::size_t first, std::size_t group,
             std::array<double, 3>& most) const {
    const double h = 0.25 * (times_[i + 1] - times_[i]);
    const double begin = times_[i] + quarter * h;
    std::array<double, 4> values{};  // squares of the norms of the control points
    std::array<double, 3> rates{};
    std::array<double, 2> bends{};
    const auto add = [](double& sum, double x) { sum += x * x; };
    for (std::size_t c = first; c < first + group; ++c) {
      const Value p = piece(i, c, begin), q = piece(i, c, begin + h);
      const double middle = piece(i, c, begin + 0.5 * h).rate;
      add(values[0], p.value);
      add(values[1], p.value + h * p.rate / 3.0);
      add(values[2], q.value - h * q.rate / 3.0);
      add(values[3], q.value);
      add(rates[0], p.rate);
      add(rates[1], 2.0 * middle - 0.5 * (p.rate + q.rate));
      add(rates[2], q.rate);
      add(bends[0], p.bend);
      add(bends[1], q.bend);
    }
    const auto raise = [](double& to, const auto& squares) {
      to = std::max(to, std::sqrt(*std::max_element(squares.begin(), squares.end())));
    };
    raise(most[0], values);
    raise(most[1], rates);
    raise(most[2], bends);
  }

  /// Second derivatives of component c from continuity of the first, with zero slope at both ends or
  /// periodic: tridiagonal, diagonally dominant, so without pivoting. The corners of the periodic
  /// one by Sherman and Morrison.
  void solve(std::size_t c) {
    const std::size_t n = periodic_ ? times_.size() - 1 : times_.size();
    std::vector<double> low(n), diagonal(n), high(n), right(n);
    const auto h = [&](std::size_t i) { return times_[i + 1] - times_[i]; };
    const auto slope = [&](std::size_t i) { return (point(i + 1, c) - point(i, c)) / h(i); };
    for (std::size_t i = 0; i < n; ++i) {
      const bool first = i == 0, last = i + 1 == times_.size();
      const std::size_t before = first ? times_.size() - 2 : i - 1;  // periodic
      const double h_before = first && !periodic_ ? 0.0 : h(before);
      const double h_after = last ? 0.0 : h(i);
      low[i] = h_before;
      diagonal[i] = 2.0 * (h_before + h_after);
      high[i] = h_after;
      right[i] = 6.0 * ((last ? 0.0 : slope(i)) - (first && !periodic_ ? 0.0 : slope(before)));
    }
    const auto put = [&](std::size_t i, double m) { bends_[i * size_ + c] = m; };
    if (!periodic_) {
      thomas(low, diagonal, high, right);
      for (std::size_t i = 0; i < n; ++i) put(i, right[i]);
      return;
    }
    if (n < 3) {  // two points and the first again: what the two equations give
      const double a = diagonal[0], b = low[0] + high[0];
      const double m0 = n == 1 ? 0.0 : (a * right[0] - b * right[1]) / (a * a - b * b);
      const double m1 = n == 1 ? 0.0 : (a * right[1] - b * right[0]) / (a * a - b * b);
      put(0, m0);
      if (n == 2) put(1, m1);
      put(n, m0);
      return;
    }
    const double corner_low = low[0], corner_high = high[n - 1], gamma = -diagonal[0];
    diagonal[0] -= gamma;
    diagonal[n - 1] -= corner_low * corner_high / gamma;
    std::vector<double> other(n, 0.0), d = diagonal;
    other[0] = gamma;
    other[n - 1] = corner_high;
    thomas(low, d, high, other);
    d = diagonal;
    thomas(low, d, high, right);
    const double part = (right[0] + corner_low * right[n - 1] / gamma) /
                        (1.0 + other[0] + corner_low * other[n - 1] / gamma);
    for (std::size_t i = 0; i < n; ++i) put(i, right[i] - part * other[i]);
    put(n, right[0] - part * other[0]);
  }

  static void thomas(const std::vector<double>& low, std::vector<double>& diagonal,
                     const std::vector<double>& high, std::vector<double>& right) {
    for (std::size_t i = 1; i < right.size(); ++i) {
      const double factor = low[i] / diagonal[i - 1];
      diagonal[i] -= factor * high[i - 1];
      right[i] -= factor * right[i - 1];
    }
    for (std::size_t i = right.size(); i-- > 0;) {
      if (i + 1 < right.size()) right[i] -= high[i] * right[i + 1];
      right[i] /= diagonal[i];
    }
  }

  std::vector<double> times_, points_, bends_;
  std::size_t size_;
  bool periodic_;
};

namespace {

/// Places of the columns that a table must have for an arm, in the order of the components.
struct Columns {
  std::size_t time = 0;
  std::vector<std::size_t> places;
  bool tip = false, polar = false;
};

Columns find_columns(const TableText& text, int segments) {
  const TextRow& names = text.rows.front();
  const auto find = [&](const std::string& name) -> std::optional<std::size_t> {
    const auto at = std::find(names.cells.begin(), names.cells.end(), name);
    if (at == names.cells.end()) return {};
    return static_cast<std::size_t>(at - names.cells.begin());
  };
  const auto need = [&](const std::string& name) {
    const auto place = find(name);
    if (!place) text.fail(names.line, fmt::format("expected a column {}", name));
    return *place;
  };
  Columns columns;
  columns.time = find("time_s").value_or(0);
  if (!find("time_s")) columns.time = need("t_s");
  const bool u = find("u1_x_rad").has_value(), polar = find("theta1_rad").has_value(),
             tip = find("tip_x_m").has_value();
  if (u + polar + tip != 1)
    text.fail(names.line,
              fmt::format("expected columns of u (u1_x_rad, u1_y_rad, ...), of the bend (phi1_rad, "
                          "theta1_rad, ...) or of the tip (tip_x_m, tip_y_m, tip_z_m), got {}",
                          u + polar + tip == 0 ? "none of them" : "several of them"));
  columns.tip = tip;
  columns.polar = polar;
  if (tip) {
    columns.places = {need("tip_x_m"), need("tip_y_m"), need("tip_z_m")};
    return columns;
  }
  for (int i = 1; i <= segments; ++i)
    for (const char* part :
         {polar ? "phi{}_rad" : "u{}_x_rad", polar ? "theta{}_rad" : "u{}_y_rad"})
      columns.places.push_back(need(fmt::format(fmt::runtime(part), i)));
  if (find(fmt::format(fmt::runtime(polar ? "theta{}_rad" : "u{}_x_rad"), segments + 1)))
    text.fail(names.line, fmt::format("expected {} segments, got more", segments));
  return columns;
}

std::shared_ptr<const TableCurve> read_curve(const std::filesystem::path& path, int segments,
                                             bool repeat) {
  const TableText text = read_table_text(path, {});
  if (text.rows.size() < 3)
    throw std::runtime_error(
        fmt::format("{}: expected a line of names and at least two points", path.string()));
  const Columns columns = find_columns(text, segments);
  std::vector<double> times, points;
  const auto number = [&](const TextRow& row, std::size_t place) {
    const auto value = text.number(row.cell(place));
    if (!value || !std::isfinite(*value))
      text.fail(row.line, fmt::format("{}: expected a number, got \"{}\"",
                                      text.rows.front().cell(place), row.cell(place)));
    return *value;
  };
  for (std::size_t k = 1; k < text.rows.size(); ++k) {
    const TextRow& row = text.rows[k];
    times.push_back(number(row, columns.time));
    if (k > 1 && !(times[k - 1] > times[k - 2]))
      text.fail(row.line, "expected a time later than that of the point before");
    for (const std::size_t place : columns.places) points.push_back(number(row, place));
    if (!columns.polar) continue;
    for (std::size_t at = points.size() - columns.places.size(); at < points.size(); at += 2) {
      const double phi = points[at], theta = points[at + 1];
      points[at] = theta * std::cos(phi);
      points[at + 1] = theta * std::sin(phi);
    }
  }
  const double first = times.front();
  for (double& time : times) time -= first;
  for (std::size_t c = 0; repeat && c < columns.places.size(); ++c)
    if (std::abs(points[c] - points[points.size() - columns.places.size() + c]) > 1e-9)
      text.fail(text.rows.back().line,
                "expected the last point to equal the first, since it repeats");
  TableCurve curve(std::move(times), std::move(points), repeat);
  curve.tip = columns.tip;
  return std::make_shared<const TableCurve>(std::move(curve));
}

}  // namespace

void TableReference::describe(Keys& key) {
  key("file", file, from(1, 400),
      "CSV, relative to this file; columns time_s and u1_x_rad, u1_y_rad, ..., or phi1_rad, "
      "theta1_rad, ..., or tip_x_m, tip_y_m, tip_z_m",
      Presence::required);
  key("repeat", repeat, "start again after the last point, which then equals the first");
  key("max_acceleration_radps2", max_acceleration_radps2, above(0, 1e5),
      "a table that asks a segment for more is refused");
  key("max_tip_speed_mps", max_tip_speed_mps, above(0, 100), "the same of a table of the tip");
  key("max_tip_acceleration_mps2", max_tip_acceleration_mps2, above(0, 1e4), "likewise");
  if (key.reading() && !file.empty()) load(key.beside("file", file), key.segments);
  key("digest", digest, from(0, 16), "of the table; left out: any. Another one is refused");
  if (key.reading() && curve_) {
    const std::string found = fmt::format("{:016x}", curve_->digest());
    if (!digest.empty() && digest != found)
      fault_ = fmt::format("another table: its digest is {}", found);
    digest = found;
  }
}

void TableReference::load(const std::filesystem::path& path, int segments) {
  try {
    if (!std::filesystem::is_regular_file(path))  // a device may never end
      throw std::runtime_error(path.string() + ": expected a file that can be read");
    curve_ = read_curve(path, segments, repeat);
  } catch (const std::exception& error) {
    fault_ = error.what();
  }
}

void TableReference::check(const ReferencePlace& place, const ControllerSettings&,
                           int segments) const {
  const ReferencePlace at{place.phase, ".file"};
  at.require(fault_.empty() && curve_ != nullptr, "a table that can be followed",
             fault_.empty() ? "none" : fault_);
  at.require(curve_->tip || curve_->size() == static_cast<std::size_t>(2 * segments),
             fmt::format("a table for {} segments", segments),
             fmt::format("{} columns", curve_->size()));
  const auto [value, speed, acceleration] = curve_->largest(curve_->tip ? 3 : 2);
  if (curve_->tip)
    at.require(
        speed <= max_tip_speed_mps,
        fmt::format("speeds of the tip within max_tip_speed_mps ({} m/s)", max_tip_speed_mps),
        fmt::format("up to {:.4g} m/s", speed));
  const double most = curve_->tip ? max_tip_acceleration_mps2 : max_acceleration_radps2;
  at.require(acceleration <= most,
             curve_->tip
                 ? fmt::format("accelerations of the tip within max_tip_acceleration_mps2 "
                               "({} m/s^2)",
                               most)
                 : fmt::format("accelerations within max_acceleration_radps2 ({} rad/s^2)", most),
             fmt::format("up to {:.4g}", acceleration));
}

double TableReference::largest_theta_rad() const noexcept {
  return curve_ && !curve_->tip ? curve_->largest(2)[0] : 0.0;
}
double TableReference::largest_speed_radps() const noexcept {
  return curve_ && !curve_->tip ? curve_->largest(2)[1] : 0.0;
}
bool TableReference::is_tip_path() const noexcept { return curve_ && curve_->tip; }
double TableReference::duration_s() const noexcept { return curve_ ? curve_->end_s() : 0.0; }

void TableReference::evaluate(double time_s, ReferenceSample& out) const noexcept {
  out.has_polar = false;
  if (!curve_) return;
  curve_->at(time_s, [&](std::size_t c, double value, double rate, double bend) {
    const auto i = static_cast<Eigen::Index>(c);
    out.u[i] = value;
    out.velocity[i] = rate;
    out.acceleration[i] = bend;
  });
}

TipReference TableReference::tip(double time_s) const noexcept {
  TipReference out;
  if (!curve_) return out;
  curve_->at(time_s, [&](std::size_t c, double value, double rate, double bend) {
    const auto i = static_cast<Eigen::Index>(c);
    out.position_m[i] = value;
    out.velocity_mps[i] = rate;
    out.acceleration_mps2[i] = bend;
  });
  return out;
}

}  // namespace softarm
