// What a pre-flight check found: one line each, for a person, and as JSON.
#pragma once

#include <span>
#include <string>
#include <vector>

namespace softarm {

/// The outcome of one check.
enum class Verdict { pass, fail, not_checked };

/// One line of the report.
struct Finding {
  std::string check = {};  ///< its name, one or two words
  Verdict verdict = Verdict::not_checked;
  std::string text =
      {};  ///< what was measured, with units; what is wrong; or why it was not checked
  std::string cure = {};  ///< of what failed
};

/// Any of them failed.
bool any_failed(std::span<const Finding> findings) noexcept;
/// The finding of this check is there and failed.
bool failed(std::span<const Finding> findings, const std::string& check) noexcept;

/// "pass  units  segments are ..." a line, then how many passed, failed and were not checked.
std::string report_text(std::span<const Finding> findings);
/// {"findings": [{"check", "verdict", "text", "cure"}], "failed": N}
std::string report_json(std::span<const Finding> findings);

}  // namespace softarm
