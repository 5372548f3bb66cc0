#include "softarm/recording/map_proposal.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cctype>
#include <cmath>
#include <stdexcept>

#include "softarm/model/arm.hpp"

namespace softarm {
namespace {

constexpr double kStill_m = 1e-3;
constexpr double kRest_s = 1.0, kLeastRest_s = 0.3;
constexpr std::size_t kLooked = 5000;  ///< rows that are looked at, spread over the table

std::string lower(std::string text) {
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

bool has(const std::string& text, std::initializer_list<const char*> words) {
  return std::any_of(words.begin(), words.end(),
                     [&](const char* word) { return text.find(word) != std::string::npos; });
}

double median(std::vector<double> values) {
  if (values.empty()) return 0.0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// A value of the map with its reason.
struct Reasoned {
  std::string value, why;
};

class Proposal {
 public:
  explicit Proposal(const CsvTable& table) : table_(table), bodies_(table.bodies) {
    for (std::size_t k = 0, step = table.rows() / kLooked + 1; k < table.rows(); k += step)
      rows_.push_back(k);
    find_time();
    if (bodies_.empty()) find_bodies();
    if (bodies_.size() < 2)
      throw std::runtime_error(fmt::format(
          "{}: expected at least two bodies, each of three columns x y z beside four of a unit "
          "quaternion, got {}; write a map, `softarm import --help`",
          table.file, bodies_.size()));
    find_unit();
    find_rest();
    put_in_order();
    find_order();
  }

  std::string text() const {
    std::string out = fmt::format("# {}, {} rows. Proposed by softarm import; check every line.\n",
                                  table_.format, table_.rows());
    const auto line = [&](const std::string& key, const Reasoned& it) {
      out += fmt::format("{}: {}  # {}\n", key, it.value, it.why);
    };
    if (!time_name_.value.empty()) line("time", time_name_);
    line("time_unit_s", time_unit_);
    line("position_unit_m", unit_);
    line("up", up());
    if (!named_ || !plain_bodies()) line("quaternion_order", order_);
    line("frame_period_s", period());
    out += fmt::format("base: {{id: 0, {}}}  # {}\n", columns(0), base_why_);
    out += "segments:  # each the nearest of those that are left\n";
    for (std::size_t i = 1; i < std::min<std::size_t>(bodies_.size(), kMaxSegments + 1); ++i)
      out += fmt::format("  - {{id: {}, {}, length_m: {:.4g}}}\n", i, columns(i),
                         std::clamp(unit_m_ * (rest_[i] - rest_[i - 1]).norm(), 1e-3, 1e3));
    out += rest_text();
    return out + pressures();
  }

 private:
  Eigen::Vector3d position(std::size_t row, std::size_t body) const {
    Eigen::Vector3d p;
    for (std::size_t i = 0; i < 3; ++i)
      p[static_cast<Eigen::Index>(i)] = table_.at(row, bodies_[body].position[i]);
    // Zeros are written where a body was not seen.
    if (rotation(row, body, false).coeffs().isZero(0.0)) p.setConstant(std::nan(""));
    return p;
  }
  Eigen::Quaterniond rotation(std::size_t row, std::size_t body, bool w_first) const {
    Eigen::Quaterniond q;
    for (std::size_t i = 0; i < 4; ++i)
      q.coeffs()[static_cast<Eigen::Index>(w_first ? (i + 3) % 4 : i)] =
          table_.at(row, bodies_[body].orientation[i]);
    return q;
  }
  double time_s(std::size_t row) const { return unit_s_ * table_.at(row, time_); }

  void find_time() {
    std::size_t at = table_.columns.size();
    if (table_.time_column) {
      at = *table_.time_column;
    } else {
      for (std::size_t k = table_.columns.size(); k-- > 0;) {
        const std::string name = lower(table_.columns[k]);
        if (name == "t" || has(name, {"time", "stamp"}) || name.starts_with("t_") || name == "ms")
          at = k;
      }
      if (at == table_.columns.size() && rises(0)) at = 0;
      if (at == table_.columns.size())
        throw std::runtime_error(
            fmt::format("{}: expected a column of times, got none that is named so", table_.file));
      const std::string& named = table_.columns[at];
      time_name_ = {plain(named) ? fmt::format("\"{}\"", named) : fmt::format("\"#{}\"", at + 1),
                    "by its name, or because it rises"};
    }
    time_ = at;
    const std::string name = lower(table_.columns[at]);
    std::vector<double> steps;
    for (std::size_t row = 1; row < std::min(table_.rows(), kLooked); ++row)
      if (const double step = table_.at(row, at) - table_.at(row - 1, at); step > 0.0)
        steps.push_back(step);
    const double step = median(std::move(steps));
    const auto choose = [&](double unit, const std::string& why) {
      unit_s_ = unit;
      time_unit_ = {fmt::format("{:g}", unit), why};
    };
    if (table_.time_column) return choose(1.0, "seconds, as the export says");
    if (has(name, {"ms", "milli"})) return choose(1e-3, "by the name of the column");
    if (has(name, {"_us", "usec", "micro"})) return choose(1e-6, "by the name of the column");
    if (has(name, {"_ns", "nsec", "nano"})) return choose(1e-9, "by the name of the column");
    const auto rows = fmt::format("rows are {:.4g} apart", step);
    if (step >= 1e5) return choose(1e-9, fmt::format("{}: nanoseconds", rows));
    if (step >= 200.0) return choose(1e-6, fmt::format("{}: microseconds", rows));
    if (step >= 0.5) return choose(1e-3, fmt::format("{}: milliseconds", rows));
    choose(1.0, fmt::format("{}: seconds", rows));
  }

  bool rises(std::size_t column) const {
    for (std::size_t row = 1; row < table_.rows(); ++row)
      if (!(table_.at(row, column) > table_.at(row - 1, column))) return false;
    return table_.rows() > 1;
  }

  /// Four neighbours whose squares add up to one.
  bool unit_quaternion(std::size_t first) const {
    if (first + 4 > table_.columns.size()) return false;
    std::size_t unit = 0, seen = 0;
    for (const std::size_t row : rows_) {
      double squares = 0.0;
      for (std::size_t i = 0; i < 4; ++i)
        squares += table_.at(row, first + i) * table_.at(row, first + i);
      if (!std::isfinite(squares) || squares == 0.0) continue;
      ++seen;
      unit += std::abs(squares - 1.0) < 0.02 ? 1 : 0;
    }
    return seen > 0 && 20 * unit >= 19 * seen;
  }

  /// Whether three neighbours are named x, y, z.
  bool named_xyz(std::size_t first) const {
    if (first + 3 > table_.columns.size()) return false;
    std::string stem;
    for (std::size_t i = 0; i < 3; ++i) {
      const std::string name = lower(table_.columns[first + i]);
      std::size_t at = name.find_last_of("xyz");
      // Behind the letter a unit at most: "base x [mm]", "x_m".
      if (at == std::string::npos || name[at] != "xyz"[i]) return false;
      const std::string rest = name.substr(0, at);
      if (i > 0 && rest != stem) return false;
      stem = rest;
    }
    return true;
  }

  void find_bodies() {
    named_ = false;
    for (std::size_t k = 0; k < table_.columns.size(); ++k) {
      if (k == time_ || !named_xyz(k) || unit_quaternion(k)) continue;
      const std::size_t behind = k + 3;
      std::size_t q = table_.columns.size();
      if (unit_quaternion(behind)) q = behind;
      if (k >= 4 && unit_quaternion(k - 4) && !taken(k - 4)) q = k - 4;
      if (q == table_.columns.size()) continue;
      const std::string name =
          table_.columns[k].substr(0, lower(table_.columns[k]).find_last_of('x'));
      bodies_.push_back({name, {k, k + 1, k + 2}, {q, q + 1, q + 2, q + 3}});
    }
  }
  bool taken(std::size_t column) const {
    return std::any_of(bodies_.begin(), bodies_.end(), [&](const TableBody& each) {
      return each.orientation[0] <= column && column <= each.orientation[3];
    });
  }

  void find_unit() {
    unit_m_ = table_.position_unit_m;
    if (unit_m_ > 0.0) {
      unit_ = {fmt::format("{:g}", unit_m_), "as the export says"};
      return;
    }
    std::vector<double> apart;
    for (const std::size_t row : rows_)
      for (std::size_t i = 1; i < bodies_.size(); ++i)
        if (const double d = (position(row, i) - position(row, i - 1)).norm();
            std::isfinite(d) && d > 0.0)
          apart.push_back(d);
    const double typical = median(std::move(apart));
    unit_m_ = typical > 5.0 ? 1e-3 : 1.0;
    unit_ = {fmt::format("{:g}", unit_m_), fmt::format("bodies are {:.4g} apart: {}", typical,
                                                       unit_m_ < 1.0 ? "millimetres" : "metres")};
  }

  /// The first second in which no body moves, or the longest part of one; else the first row with
  /// all bodies.
  void find_rest() {
    std::vector<std::size_t> window;
    for (std::size_t row = 0; row < table_.rows(); ++row) {
      bool seen = std::isfinite(time_s(row));
      for (std::size_t i = 0; i < bodies_.size(); ++i)
        seen = seen && position(row, i).allFinite() && rotation(row, i, false).coeffs().allFinite();
      if (!seen) continue;
      if (rest_.empty()) take_rest(row);
      for (std::size_t i = 0; i < bodies_.size() && !window.empty(); ++i)
        if (unit_m_ * (position(row, i) - position(window.front(), i)).norm() > kStill_m)
          window.clear();
      window.push_back(row);
      const double still_s = time_s(row) - time_s(window.front());
      if (still_s < kLeastRest_s || still_s <= rest_to_s_ - rest_from_s_) continue;
      take_rest(window.front());
      rest_from_s_ = time_s(window.front());
      rest_to_s_ = time_s(row);
      still_ = true;
      if (still_s >= kRest_s) return;
    }
    if (rest_.empty())
      throw std::runtime_error(
          fmt::format("{}: expected a row in which every body was seen, got none", table_.file));
  }
  void take_rest(std::size_t row) {
    rest_row_ = row;
    rest_.clear();
    for (std::size_t i = 0; i < bodies_.size(); ++i) rest_.push_back(position(row, i));
  }

  double moved(std::size_t body) const {
    double most = 0.0;
    for (const std::size_t row : rows_)
      if (const double d = (position(row, body) - rest_[body]).norm(); std::isfinite(d))
        most = std::max(most, d);
    return most;
  }

  /// The base first, then always the nearest of those that are left.
  void put_in_order() {
    std::size_t base = 0;
    for (std::size_t i = 1; i < bodies_.size(); ++i)
      if (moved(i) < moved(base)) base = i;
    base_why_ = fmt::format("moves least, by {:.2g} m", unit_m_ * moved(base));
    std::swap(bodies_[0], bodies_[base]);
    std::swap(rest_[0], rest_[base]);
    for (std::size_t i = 1; i < bodies_.size(); ++i) {
      std::size_t nearest = i;
      for (std::size_t j = i + 1; j < bodies_.size(); ++j)
        if ((rest_[j] - rest_[i - 1]).norm() < (rest_[nearest] - rest_[i - 1]).norm()) nearest = j;
      std::swap(bodies_[i], bodies_[nearest]);
      std::swap(rest_[i], rest_[nearest]);
    }
  }

  /// How far chords turn otherwise than halfway between their two ends, as a bend makes them.
  double bend_error(bool w_first) const {
    double sum = 0.0;
    for (const std::size_t row : rows_)
      for (std::size_t i = 1; i < bodies_.size(); ++i) {
        const auto turn = [&](std::size_t body) {
          return (rotation(row, body, w_first) * rotation(rest_row_, body, w_first).conjugate())
              .normalized();
        };
        const Eigen::Vector3d then = (rest_[i] - rest_[i - 1]).normalized();
        const Eigen::Vector3d now = (position(row, i) - position(row, i - 1)).normalized();
        const double error = (turn(i - 1).slerp(0.5, turn(i)) * then - now).squaredNorm();
        if (std::isfinite(error)) sum += error;
      }
    return sum;
  }

  void find_order() {
    if (named_) return;
    const std::string first = lower(table_.columns[bodies_[0].orientation[0]]);
    const std::string last = lower(table_.columns[bodies_[0].orientation[3]]);
    const auto ends_with_w = [](const std::string& name) {
      return name.find_last_of("wxyz") != std::string::npos &&
             name[name.find_last_of("wxyz")] == 'w';
    };
    if (ends_with_w(first) != ends_with_w(last)) {
      order_ = {ends_with_w(first) ? "wxyz" : "xyzw", "by the names of the columns"};
      return;
    }
    const double as_xyzw = bend_error(false), as_wxyz = bend_error(true);
    order_ = {
        as_wxyz < as_xyzw ? "wxyz" : "xyzw",
        fmt::format("orientations then follow positions better (errors {:.2g} against {:.2g})",
                    std::min(as_xyzw, as_wxyz), std::max(as_xyzw, as_wxyz))};
  }

  Eigen::Vector3d to_tip() const { return (rest_.back() - rest_.front()).normalized(); }

  Reasoned up() const {
    Eigen::Index axis = 2;
    const double share = to_tip().cwiseAbs().maxCoeff(&axis);
    const char* const names[] = {"x", "y", "z"};
    if (share < 0.9)
      return {table_.format.find("Motive") != std::string::npos ? "y" : "z",
              "NOT SURE: the arm hangs along no axis; the program's usual one"};
    return {names[axis],
            fmt::format("at rest the arm {} along {} ({:.2f} of its direction)",
                        to_tip()[axis] < 0.0 ? "hangs down" : "stands up", names[axis], share)};
  }

  Reasoned period() const {
    if (table_.frame_period_s > 0.0)
      return {fmt::format("{:.6g}", std::clamp(table_.frame_period_s, 1e-6, 1e3)),
              "as the export says"};
    std::vector<double> steps;
    std::size_t before = 0;
    for (std::size_t row = 1; row < std::min(table_.rows(), kLooked); ++row) {
      if ((position(row, bodies_.size() - 1) - position(before, bodies_.size() - 1)).isZero(0.0))
        continue;
      steps.push_back(time_s(row) - time_s(before));
      before = row;
    }
    const double step = median(std::move(steps));
    return {fmt::format("{:.6g}", step > 0.0 ? std::clamp(step, 1e-6, 1e3) : 0.01),
            "typical time from one pose to another one"};
  }

  /// A column as a map names it: by its number where the name would need quotes within quotes.
  std::string column(std::size_t k) const {
    const std::string& name = table_.columns[k];
    return plain(name) ? fmt::format("'{}'", name) : fmt::format("'#{}'", k + 1);
  }
  static bool plain(const std::string& name) {
    return name.size() <= 100 && std::all_of(name.begin(), name.end(), [](char c) {
             return c >= ' ' && c <= '~' && c != '\'' && c != '"' && c != '\\';
           });
  }
  bool plain_bodies() const {
    return std::all_of(bodies_.begin(), bodies_.end(), [](const TableBody& each) {
      return plain(each.name) && !each.name.empty();
    });
  }
  std::string columns(std::size_t body) const {
    if (named_ && plain_bodies()) return fmt::format("body: \"{}\"", bodies_[body].name);
    const auto list = [&](const auto& columns) {
      std::string text;
      for (const std::size_t k : columns)
        text += fmt::format("{}{}", text.empty() ? "" : " ", column(k));
      return text;
    };
    return fmt::format("position: \"{}\", orientation: \"{}\"", list(bodies_[body].position),
                       list(bodies_[body].orientation));
  }

  std::string rest_text() const {
    if (!still_)
      return "# rest: {from_s: 0, to_s: 1}  # NOT FOUND: no 0.3 s in which the arm is still "
             "within 1 mm\n";
    const bool standing = to_tip().maxCoeff() > 0.9;
    return fmt::format(
        "rest: {{from_s: {:.12g}, to_s: {:.12g}{}}}  # without motion, within 1 mm\n", rest_from_s_,
        rest_to_s_, standing ? ", base_rotation: standing" : "");
  }

  std::string pressures() const {
    std::string commanded, measured, unit_name;
    double most = 0.0;
    for (std::size_t k = 0; k < table_.columns.size(); ++k) {
      const std::string name = lower(table_.columns[k]);
      // p1, p_1, pd_1, pm_1
      const std::size_t digit = name.find_first_of("0123456789");
      const bool numbered =
          name[0] == 'p' && (digit == 1 || (digit <= 3 && has("_dm", {name.substr(1, 1).c_str()})));
      if (!numbered && !has(name, {"press", "bar", "kpa", "psi", "valve"})) continue;
      std::string& list =
          has(name, {"set", "cmd", "command", "ref", "des", "goal", "pd_"}) ? commanded : measured;
      list += fmt::format("{}{}", list.empty() ? "" : " ", column(k));
      for (const char* unit : {"mbar", "kpa", "psi", "bar"})
        if (unit_name.empty() && has(name, {unit})) unit_name = unit;
      for (const std::size_t row : rows_)
        if (std::isfinite(table_.at(row, k))) most = std::max(most, std::abs(table_.at(row, k)));
    }
    if (commanded.empty() && measured.empty())
      return "# pressures: {commanded: ..., measured: ...}  # no column is named so\n";
    double unit = most > 2e4 ? 1e-5 : most > 2e3 ? 1e-3 : most > 20.0 ? 1e-2 : 1.0;
    std::string why = fmt::format("the largest is {:.4g}{}", most,
                                  most > 5.0 && most <= 20.0 ? ": bar, or psi (0.0689476)?" : "");
    if (!unit_name.empty()) {
      unit = unit_name == "kpa"    ? 1e-2
             : unit_name == "mbar" ? 1e-3
             : unit_name == "psi"  ? 0.0689476
                                   : 1.0;
      why = "by the names of the columns";
    }
    std::string out = fmt::format("pressures:\n  unit_bar: {:g}  # {}\n", unit, why);
    if (!commanded.empty()) out += fmt::format("  commanded: \"{}\"\n", commanded);
    if (!measured.empty())
      out += fmt::format("  measured: \"{}\"  # not named as set points\n", measured);
    return out;
  }

  const CsvTable& table_;
  std::vector<TableBody> bodies_;
  std::vector<std::size_t> rows_;
  bool named_ = true;  ///< the header names the bodies
  std::size_t time_ = 0;
  double unit_s_ = 1.0, unit_m_ = 1.0;
  Reasoned time_name_, time_unit_, unit_, order_ = {"xyzw", "as the export has it"};
  std::string base_why_;
  std::vector<Eigen::Vector3d> rest_;
  std::size_t rest_row_ = 0;
  double rest_from_s_ = 0.0, rest_to_s_ = 0.0;
  bool still_ = false;
};

}  // namespace

std::string propose_map(const CsvTable& table) { return Proposal(table).text(); }

}  // namespace softarm
