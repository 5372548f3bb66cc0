// Motion capture that does not come over LCM: a connection to the system's own server.
#pragma once

#include <cstdint>

#include "softarm/transport/mocap_format.hpp"

namespace softarm {

/// What became of the packets that had arrived.
enum class MocapNews {
  nothing,    ///< no more has arrived
  frame,      ///< the next frame, with the ids of the configuration
  malformed,  ///< a packet that is not of the protocol
};

/// How far a connection is.
struct MocapStanding {
  /// no_body: the server does not know a configured body.
  enum class State { silent, no_body, running };
  State state = State::silent;
  const char* body = "";  ///< no_body: a name that the server does not know

  /// For a person; `body` follows.
  const char* text() const noexcept;
  bool operator==(const MocapStanding&) const = default;
};

/// A client of a motion-capture server. It connects, and connects again, by itself. Belongs to one
/// thread.
class MocapConnection {
 public:
  virtual ~MocapConnection() = default;

  /// Takes one step of what has arrived. Called in the tick: it never waits, allocates or throws,
  /// and takes a bounded number of packets.
  /// @param arrival_ns written with a frame: when it came in, on the monotonic clock, at most now
  virtual MocapNews next(std::int64_t now_ns, SentFrame& frame,
                         std::int64_t& arrival_ns) noexcept = 0;

  virtual MocapStanding standing() const noexcept = 0;
};

/// The other end, for a simulated arm. Belongs to one thread.
class MocapServer {
 public:
  virtual ~MocapServer() = default;
  /// Answers requests that have arrived, and sends a frame to the clients. Does not wait.
  virtual void send(const SentFrame& frame) = 0;
};

}  // namespace softarm
