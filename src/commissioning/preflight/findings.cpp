#include "softarm/commissioning/preflight/findings.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

namespace softarm {
namespace {

const char* name(Verdict verdict) {
  constexpr const char* kNames[] = {"pass", "FAIL", "not checked"};
  return kNames[static_cast<std::size_t>(verdict)];
}

std::ptrdiff_t count(std::span<const Finding> findings, Verdict verdict) {
  return std::count_if(findings.begin(), findings.end(),
                       [&](const Finding& each) { return each.verdict == verdict; });
}

}  // namespace

bool any_failed(std::span<const Finding> findings) noexcept {
  return count(findings, Verdict::fail) > 0;
}

bool any_not_checked(std::span<const Finding> findings) noexcept {
  return count(findings, Verdict::not_checked) > 0;
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
                        each.fix.empty() ? "" : ". Fix: ", each.fix);
  return text + fmt::format("{} passed, {} failed, {} not checked\n",
                            count(findings, Verdict::pass), count(findings, Verdict::fail),
                            count(findings, Verdict::not_checked));
}

std::string report_json(std::span<const Finding> findings) {
  using Json = nlohmann::ordered_json;
  Json list = Json::array();
  for (const Finding& each : findings)
    list.push_back({{"check", each.check},
                    {"verdict", name(each.verdict)},
                    {"text", each.text},
                    {"cure", each.fix}});
  const Json report{{"findings", std::move(list)}, {"failed", count(findings, Verdict::fail)}};
  return report.dump(-1, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace softarm
