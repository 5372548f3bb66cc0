// What a configuration may say: every key once, with its type, unit, range, default and meaning.
// Reading, printing and documenting are three visitors of this one description.
#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "softarm/config/experiment.hpp"

namespace softarm {

/// Closed interval, but open at `low` where it says so.
struct Range {
  double low = -std::numeric_limits<double>::max();
  double high = std::numeric_limits<double>::max();
  bool above_low = false;

  bool contains(double x) const { return (above_low ? x > low : x >= low) && x <= high; }
  std::string text() const;  ///< "in (0, 10]"
};
inline Range from_to(double low, double high) { return {low, high, false}; }
inline Range above_to(double low, double high) { return {low, high, true}; }

enum class Presence { optional, required };

/// One key. The default of an optional one is the value the variable holds before the visit.
struct Field {
  const char* key;
  const char* unit;  ///< "" where there is none
  const char* doc;
  Range range = {};
  Presence presence = Presence::optional;
};

/// How many numbers a key takes, and how they may be abbreviated.
struct Shape {
  enum class Kind {
    list,             ///< `count` numbers; any number of them, at least one, where count is 0
    scalar_or_list,   ///< one for all, or a list of `count`
    scalar_or_pairs,  ///< one for all, or a list of `count`, each a number for both axes or [x, y]
    matrix            ///< `count` rows of `count`
  };
  Kind kind;
  int count;
};

/// How a section is printed.
enum class SectionKind {
  plain,
  defaults_elsewhere,  ///< its defaults are values of other sections: the template only hints at it
  defaults_by_choice,  ///< its defaults depend on the key before: the template only hints at it
  input_only           ///< turned into values of other keys: not part of the resolved configuration
};

class SchemaVisitor {
 public:
  using Body = std::function<void()>;
  using ItemBody = std::function<void(int)>;

  virtual ~SchemaVisitor() = default;

  virtual bool reading() const = 0;
  /// Of two ways to say the same: whether the first is used. Reading: it is in the file (and the
  /// second is not).
  virtual bool prefers(const char* first, const char* second) = 0;

  virtual void number(const Field& field, double& value) = 0;
  virtual void optional_number(const Field& field, std::optional<double>& value) = 0;
  virtual void numbers(const Field& field, const Shape& shape, std::vector<double>& values) = 0;
  virtual void integer(const Field& field, std::int64_t& value) = 0;
  /// `word` stands for -1.
  virtual void integer_or_word(const Field& field, const char* word, std::int64_t& value) = 0;
  virtual void integers(const Field& field, int count, std::vector<int>& values) = 0;
  virtual void flag(const Field& field, bool& value) = 0;
  virtual void text(const Field& field, std::string& value) = 0;
  virtual void choice(const Field& field, std::span<const char* const> names, int& index) = 0;
  /// `names[i]` stands for `values[i]`; where none fits, the rows of the matrix.
  virtual void matrix_or_word(const Field& field, std::span<const char* const> names,
                              std::span<const Eigen::Matrix3d> values, Eigen::Matrix3d& value) = 0;

  virtual void section(const Field& field, SectionKind kind, const Body& body) = 0;
  /// A list of sections; reading sets the size before the items are visited.
  virtual void list(const Field& field, int size, const std::function<void(int)>& resize,
                    const ItemBody& item) = 0;
  /// One section for all `count`, or a list of `count`.
  virtual void shared_or_list(const Field& field, int count, bool all_equal,
                              const ItemBody& item) = 0;

  // Conveniences on top of the above.
  void integer(const Field& field, int& value) {
    std::int64_t wide = value;
    integer(field, wide);
    value = static_cast<int>(wide);
  }
  void vector3(const Field& field, Eigen::Vector3d& value) {
    std::vector<double> values(value.data(), value.data() + 3);
    numbers(field, {Shape::Kind::list, 3}, values);
    value = Eigen::Map<const Eigen::Vector3d>(values.data());
  }
  template <typename Enum>
  void choice(const Field& field, std::span<const char* const> names, Enum& value) {
    int index = static_cast<int>(value);
    choice(field, names, index);
    value = static_cast<Enum>(index);
  }
};

/// Visits the whole configuration in the order in which it is printed.
void describe_experiment(SchemaVisitor& visitor, Experiment& experiment);

// Its parts, in files of their own.
void describe_arm(SchemaVisitor& visitor, ArmParameters& arm);
void describe_actuation(SchemaVisitor& visitor, ActuationSettings& actuation, int segments);
/// Its first key, and all of them for actuation by torque.
ActuationKind describe_actuation_kind(SchemaVisitor& visitor, ActuationSettings& actuation,
                                      int segments);
void describe_estimation(SchemaVisitor& visitor, EstimationSettings& estimation);
void describe_control(SchemaVisitor& visitor, ControllerSettings& control, int segments);
void describe_reference(SchemaVisitor& visitor, ReferenceSettings& reference, int segments);
void describe_daemon(SchemaVisitor& visitor, Experiment& experiment, int segments);
void describe_plant(SchemaVisitor& visitor, Experiment& experiment);
/// `chambers` of the whole arm.
void describe_valves(SchemaVisitor& visitor, ValveDriverSettings& valves, int chambers);
/// A curvature of every segment, as `theta_rad` and `phi_rad` or as `u_rad`; `what` tells whose.
void describe_pose(SchemaVisitor& visitor, std::vector<double>& u_rad, int segments,
                   Presence presence);

}  // namespace softarm
