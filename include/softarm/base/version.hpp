// Version, commit and build of this program.
#pragma once

#include <string>

namespace softarm {

/// The release, for example "0.1.0".
const char* version_text() noexcept;
/// The commit this was built from, with "-dirty" where the working tree differed from it.
const char* commit_text() noexcept;

/// Everything that decides how numbers round: version and commit, compiler, the instruction sets
/// compiled for, those of this machine by which the C library selects its functions, and the
/// version of that library.
std::string build_text();

}  // namespace softarm
