// How the value of a key may be written.
#pragma once

#include <initializer_list>
#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace softarm {

/// Words that stand for numbers, or numbers of a range, alone or in lists.
struct Form {
  /// What may stand for numbers.
  struct Word {
    std::string text;
    std::vector<double> numbers;
  };
  static constexpr int kAny = 0;

  double low = -std::numeric_limits<double>::max();
  double high = std::numeric_limits<double>::max();
  bool above_low = false;  ///< `low` itself is out of range
  bool numeric = true;     ///< false: words alone
  bool whole = false;
  /// Of the lists, outermost first; none: one number; kAny: at least one item.
  std::vector<int> sizes = {};
  bool sized_by_keys = false;  ///< the outermost size is the variable's, decided by other keys
  bool one_for_all = false;    ///< a number may stand for a list of equal ones
  std::vector<Word> words = {};

  /// A list of any length; of as many numbers as the variable has; the same, or one for all; the
  /// same of pairs [x, y], or one for both.
  Form list() const { return sized({kAny}, false, false); }
  Form each() const { return sized({kAny}, true, false); }
  Form one_or_each() const { return sized({kAny}, true, true); }
  Form one_or_pairs() const { return sized({kAny, 2}, true, true); }
  Form or_word(const char* word, double number) const { return or_word(word, std::vector{number}); }
  Form or_word(const char* word, const std::vector<double>& numbers) const;

  bool contains(double x) const { return (above_low ? x > low : x >= low) && x <= high; }
  bool is_flag() const { return !numeric && words.front().text == "false"; }
  /// The word for these numbers, or the numbers of this word; nullptr where there is none.
  const Word* find(const std::vector<double>& numbers) const;
  const Word* find(std::string_view word) const;
  /// "a number or a list of 3 in (0, 10] m"; without `counted` the sizes that other keys decide are
  /// left out.
  std::string text(std::string_view unit, bool counted = true) const;

 private:
  Form sized(const std::vector<int>& outermost_first, bool by_keys, bool one) const;
};

Form from(double low, double high);   ///< [low, high]
Form above(double low, double high);  ///< (low, high]
/// The first stands for 0, the second for 1, ...
Form one_of(std::span<const char* const> names);
Form one_of(std::initializer_list<const char*> names);
/// Of the base frame in the world: "hanging", "standing", or a matrix.
Form base_rotation();

}  // namespace softarm
