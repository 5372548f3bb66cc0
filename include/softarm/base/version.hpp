// What was built, from which commit.
#pragma once

#include <string>

namespace softarm {

/// "0.1.0"
const char* version_text() noexcept;
/// The commit this was built from, "-dirty" where the tree differed from it.
const char* commit_text() noexcept;

/// What decides how numbers round: version and commit, compiler, the instruction set compiled for,
/// the one that the C library's functions choose by on this machine, and that library's version.
std::string build_text();

}  // namespace softarm
