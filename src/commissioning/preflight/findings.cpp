#include "softarm/commissioning/preflight/findings.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "softarm/base/json_writer.hpp"

namespace softarm {
namespace {

const char* name(Verdict verdict) {
  switch (verdict) {
    case Verdict::pass:
      return "pass";
    case Verdict::fail:
      return "FAIL";
    case Verdict::not_checked:
      return "not checked";
  }
  return "unknown";
}

std::ptrdiff_t count(std::span<const Finding> findings, Verdict verdict) {
  return std::count_if(findings.begin(), findings.end(),
                       [&](const Finding& each) { return each.verdict == verdict; });
}

}  // namespace

bool any_failed(std::span<const Finding> findings) noexcept {
  return count(findings, Verdict::fail) > 0;
}

bool failed(std::span<const Finding> findings, const std::string& check) noexcept {
  return std::any_of(findings.begin(), findings.end(), [&](const Finding& each) {
    return each.verdict == Verdict::fail && each.check == check;
  });
}

std::string report_text(std::span<const Finding> findings) {
  std::string text;
  for (const Finding& each : findings)
    text += fmt::format("{:<11}  {:<16}  {}{}{}\n", name(each.verdict), each.check, each.text,
                        each.cure.empty() ? "" : ". Mend: ", each.cure);
  return text + fmt::format("{} passed, {} failed, {} not checked\n",
                            count(findings, Verdict::pass), count(findings, Verdict::fail),
                            count(findings, Verdict::not_checked));
}

std::string report_json(std::span<const Finding> findings) {
  JsonWriter json;
  json.open_object();
  json.key("findings");
  json.open_array();
  for (const Finding& each : findings) {
    json.open_object();
    json.member("check", each.check);
    json.member("verdict", name(each.verdict));
    json.member("text", each.text);
    json.member("cure", each.cure);
    json.close_object();
  }
  json.close_array();
  json.member("failed", static_cast<std::int64_t>(count(findings, Verdict::fail)));
  json.close_object();
  return json.text() + "\n";
}

}  // namespace softarm
