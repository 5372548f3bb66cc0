// Results of the pre-run checks: one line each for a person, and as JSON.
#pragma once

#include <span>
#include <string>
#include <vector>

namespace softarm {

/// Result of a check.
enum class Verdict { pass, fail, not_checked };

/// One line of the report.
struct Finding {
  std::string check = {};  ///< its name, one or two words
  Verdict verdict = Verdict::not_checked;
  std::string text =
      {};  ///< what was measured, with units; what is wrong; or why it was not checked
  std::string fix = {};  ///< how to fix what failed

  static Finding passed(const std::string& check, const std::string& text) {
    return {check, Verdict::pass, text, ""};
  }
  static Finding failed(const std::string& check, const std::string& text, const std::string& fix) {
    return {check, Verdict::fail, text, fix};
  }
  static Finding not_checked(const std::string& check, const std::string& why) {
    return {check, Verdict::not_checked, why, ""};
  }
};

/// Whether any of them failed.
bool any_failed(std::span<const Finding> findings) noexcept;
/// Whether any of them was not checked.
bool any_not_checked(std::span<const Finding> findings) noexcept;
/// Whether there is a finding of this check, and it failed.
bool failed(std::span<const Finding> findings, const std::string& check) noexcept;

/// One line per finding ("pass  units  segments are ..."), then how many passed, failed and were
/// not checked.
std::string report_text(std::span<const Finding> findings);
/// {"findings": [{"check", "verdict", "text", "cure"}], "failed": N}
std::string report_json(std::span<const Finding> findings);

}  // namespace softarm
