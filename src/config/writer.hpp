// The printing visitor: the resolved configuration with units, or the documented template.
#pragma once

#include <optional>
#include <set>
#include <string>

#include "config/schema.hpp"

namespace softarm {

enum class Documentation { units, full };

class ExperimentWriter : public SchemaVisitor {
 public:
  explicit ExperimentWriter(Documentation documentation)
      : documented_(documentation == Documentation::full) {}

  const std::string& text() const { return out_; }

  bool reading() const override { return false; }
  /// The template shows the second, friendlier form; the resolved configuration the first, which is
  /// exact.
  bool prefers(const char*, const char*) override { return !documented_; }
  void number(const Field& field, double& value) override;
  void optional_number(const Field& field, std::optional<double>& value) override;
  void numbers(const Field& field, const Shape& shape, std::vector<double>& values) override;
  void integer(const Field& field, std::int64_t& value) override;
  void integer_or_word(const Field& field, const char* word, std::int64_t& value) override;
  void integers(const Field& field, int count, std::vector<int>& values) override;
  void flag(const Field& field, bool& value) override;
  void text(const Field& field, std::string& value) override;
  void choice(const Field& field, std::span<const char* const> names, int& index) override;
  void matrix_or_word(const Field& field, std::span<const char* const> names,
                      std::span<const Eigen::Matrix3d> values, Eigen::Matrix3d& value) override;
  void section(const Field& field, SectionKind kind, const Body& body) override;
  void list(const Field& field, int size, const std::function<void(int)>& resize,
            const ItemBody& item) override;
  void shared_or_list(const Field& field, int count, bool all_equal, const ItemBody& item) override;
  using SchemaVisitor::choice;
  using SchemaVisitor::integer;

 private:
  std::string margin(int depth) const;
  void document(const Field& field, const std::string& what);
  void entry(const Field& field, const std::string& value, const std::string& what);
  void line(const std::string& content);
  void comment(const std::string& content);
  void items(int count, const ItemBody& item);

  std::string out_;
  int depth_ = 0;
  bool documented_;
  std::optional<int> hint_depth_;  ///< where a hint starts that is not in force
  bool brief_ = false;             ///< keys already documented elsewhere
  bool dash_ = false;              ///< the next line starts an item of a list
  int lists_ = 0;                  ///< around this place
  std::set<std::string> told_;     ///< keys already documented in items before
};

}  // namespace softarm
