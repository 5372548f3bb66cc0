// Bodies that a configuration names, and the numbers by which a server sends them.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "softarm/transport/mocap_format.hpp"
#include "softarm/transport/settings.hpp"

namespace softarm {

/// One of the arm's bodies: the base where it is tracked, and the segments' ends.
struct NamedBody {
  std::string name;                     ///< empty: sent under its configured id
  std::int32_t id = 0;                  ///< as configured
  std::optional<std::int32_t> sent_id;  ///< none: the server has not named it yet
};

/// Replaces the server's ids in frames by those of the configuration. Allocates only when made.
class BodyNames {
 public:
  explicit BodyNames(const BodySettings& bodies);

  const std::vector<NamedBody>& bodies() const noexcept { return bodies_; }
  /// Whether any body goes by its name.
  bool used() const noexcept { return used_; }
  /// Forgets what the server has named.
  void forget() noexcept;
  void note(std::string_view name, std::int32_t sent_id) noexcept;
  /// The first body that the server has not named; nullptr if there is none.
  const NamedBody* missing() const noexcept;
  /// From the server's ids to ours; a body of another name gets an id that no body has.
  void translate(SentFrame& frame) const noexcept;

 private:
  std::vector<NamedBody> bodies_;
  bool used_ = false;
};

}  // namespace softarm
