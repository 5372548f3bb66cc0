// The input of `softarm eval`.
#pragma once

#include <string>
#include <vector>

#include "softarm/control/evaluation.hpp"

namespace softarm {

/// Reads `{cases: [...]}` from JSON or YAML. @throws ConfigError
std::vector<EvalCase> read_eval_cases(const std::string& file);

}  // namespace softarm
