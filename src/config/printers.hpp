// Output formats of the keys that were visited.
#pragma once

#include <string>

#include "softarm/config/config_keys.hpp"

namespace softarm {

/// YAML that reads back the same: with units in comments, or documented in full, values that are
/// taken over from elsewhere as hints in comments.
std::string yaml_text(const Entry& root, bool documented);

/// A JSON Schema (draft 7) by which editors complete and check a file. It accepts whatever is read
/// without an error; what depends on several keys is for the reader alone. Keys are required only
/// in files without `include`. `root` was visited for ConfigKeys::Purpose::schema with one item of every
/// kind in lists, whose required words tell the kinds apart.
std::string json_schema_text(const Entry& root);

}  // namespace softarm
