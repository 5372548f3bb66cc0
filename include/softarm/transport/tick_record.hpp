// A tick on the wire: everything the pipeline was given, so that it can be given again.
#pragma once

#include <cstddef>
#include <cstdint>
#include <softarm_messages/tick_record_t.hpp>
#include <span>
#include <string>
#include <vector>

#include "softarm/runtime/control_pipeline.hpp"
#include "softarm/runtime/settings.hpp"
#include "softarm/transport/output_messages.hpp"

namespace softarm {

/// Writes every field of `input` into the record. Allocates nothing where the record's lists have
/// the length (or the capacity) already.
void to_record(const TickInput& input, softarm_messages::tick_record_t& record);

/// Whether an encoded record ends with the digest of what precedes it.
bool is_intact(std::span<const std::byte> encoded) noexcept;

/// A TickInput and what it points to.
class RecordedInput {
 public:
  /// What to_record was given, bit for bit; valid until the next call. The record must have come
  /// through decode().
  const TickInput& from(const softarm_messages::tick_record_t& record);

 private:
  TickInput input_;
  std::vector<MocapFrame> frames_;
  LiveReferenceInput reference_;
  PressureVector measured_bar_;
};

/// Encodes the records of consecutive ticks and keeps each to be sent once more kRepeatAfter ticks
/// later: a logger that was kept from its work for a moment loses what arrives just then, and
/// without its record a tick cannot be replayed. After construction nothing here allocates.
class TickRecorder {
 public:
  static constexpr int kRepeatAfter = 50;
  static constexpr int kMostFrames = 64;  ///< in a tick

  TickRecorder(const PipelineSettings& settings, const Provenance& provenance, bool shadow);

  /// Encoded record of a tick; valid until the next call. Before it, where full(), the oldest is to
  /// be taken. Ticks count from 1. Empty if it did not fit.
  std::span<const std::byte> record(std::int64_t tick, const TickInput& input,
                                    const PressureVector& command) noexcept;

  /// kRepeatAfter records are kept.
  bool full() const noexcept { return kept_ == kRepeatAfter; }
  /// Takes the oldest of the records kept; valid until the next call of record(). Empty if none is.
  std::span<const std::byte> take_oldest() noexcept;

  /// As many frames fit into a record of this arm: 1 to kMostFrames.
  int frame_capacity() const noexcept { return static_cast<int>(record_.frames.size()); }

 private:
  softarm_messages::tick_record_t record_;
  std::string build_;
  std::int64_t ticks_per_build_;
  std::size_t slot_bytes_;
  std::vector<std::byte> slots_;
  std::vector<std::size_t> sizes_;
  int next_ = 0;  ///< slot to write
  int kept_ = 0;
};

}  // namespace softarm
