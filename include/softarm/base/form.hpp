// The form of a key's value: numbers or words, range, sizes of lists.
#pragma once

#include <initializer_list>
#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace softarm {

/// A double holds every whole number up to here.
inline constexpr double kLargestWhole = 0x1p53;

/// The form of a value: words that represent numbers, or numbers in a range, alone or in lists.
struct Form {
  /// A word that represents numbers.
  struct Word {
    std::string text;
    std::vector<double> numbers;
  };
  static constexpr int kAny = 0;

  double low = -std::numeric_limits<double>::max();
  double high = std::numeric_limits<double>::max();
  bool above_low = false;  ///< `low` itself is out of range
  bool numeric = true;     ///< false: words only
  bool whole = false;
  /// Sizes of nested lists, outermost first; empty: a single number; kAny: at least one item.
  std::vector<int> sizes = {};
  bool sized_by_keys = false;  ///< the outermost size follows from other keys
  bool one_for_all = false;    ///< one number may replace a list of equal ones
  std::vector<Word> words = {};

  /// The same form as a list of any length.
  Form list() const { return sized({kAny}, false, false); }
  /// A list of as many numbers as the variable has.
  Form each() const { return sized({kAny}, true, false); }
  /// The same, or one number for all.
  Form one_or_each() const { return sized({kAny}, true, true); }
  /// The same with pairs [x, y], or one number for both.
  Form one_or_pairs() const { return sized({kAny, 2}, true, true); }
  /// The same form, where a word may replace the number or the list of numbers.
  Form or_word(const char* word, double number) const { return or_word(word, std::vector{number}); }
  Form or_word(const char* word, const std::vector<double>& numbers) const;

  /// Whether a number is in the range.
  bool contains(double x) const { return (above_low ? x > low : x >= low) && x <= high; }
  /// Whether the words are false and true.
  bool is_flag() const { return !numeric && words.front().text == "false"; }
  /// The word for these numbers, or the entry of this word; nullptr if there is none.
  const Word* find(const std::vector<double>& numbers) const;
  const Word* find(std::string_view word) const;
  /// "a number or a list of 3 in (0, 10] m"; without `counted` sizes that follow from other keys
  /// are left out.
  std::string text(std::string_view unit, bool counted = true) const;

 private:
  Form sized(const std::vector<int>& outermost_first, bool by_keys, bool one) const;
};

Form from(double low, double high);   ///< [low, high]
Form above(double low, double high);  ///< (low, high]
/// One of these words: the first means 0, the second 1, ...
Form one_of(std::span<const char* const> names);
Form one_of(std::initializer_list<const char*> names);
/// Rotation of the base frame in the world: "hanging", "standing", or a matrix.
Form base_rotation();

}  // namespace softarm
