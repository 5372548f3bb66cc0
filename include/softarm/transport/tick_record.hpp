// The record of a tick: all inputs of the pipeline, so that the tick can be replayed.
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

inline constexpr std::size_t kRecordDigest = 8;  ///< bytes at the end of every record

/// Writes every field of `input` into the record. Allocates nothing if the record's lists are long
/// enough already (in size or capacity).
void to_record(const TickInput& input, softarm_messages::tick_record_t& record);

/// Whether an encoded record ends with the digest of what precedes it.
bool is_intact(std::span<const std::byte> encoded) noexcept;

/// A TickInput restored from a record, with the data it points to.
class RecordedInput {
 public:
  /// The input that to_record was given, bit for bit; valid until the next call. The record must
  /// have been checked by decode().
  const TickInput& from(const softarm_messages::tick_record_t& record);

 private:
  TickInput input_;
  std::vector<MocapFrame> frames_;
  LiveReferenceInput reference_;
  TipTargetInput tip_target_;
  LawInput law_;
  PressureVector measured_bar_;
};

/// Encodes the records of consecutive ticks and keeps each to be sent again kRepeatAfter ticks
/// later: a logger that is held up for a moment loses what arrives just then, and without its
/// record a tick cannot be replayed. After construction nothing allocates.
class TickRecorder {
 public:
  static constexpr int kRepeatAfter = 50;  ///< ticks
  static constexpr int kMostFrames = 64;   ///< in a tick

  /// Allocates for the largest record of the arm of `settings`. @param shadow  mark records as such
  TickRecorder(const PipelineSettings& settings, const Provenance& provenance, bool shadow);

  /// Encoded record of a tick; valid until the next call. If full(), call take_oldest() first.
  /// Ticks are counted from 1. Empty if the record did not fit.
  std::span<const std::byte> record(std::int64_t tick, const TickInput& input,
                                    const PressureVector& command) noexcept;

  /// Whether kRepeatAfter records are kept.
  bool full() const noexcept { return kept_ == kRepeatAfter; }
  /// Removes and returns the oldest record kept; valid until the next call of record(). Empty if
  /// there is none.
  std::span<const std::byte> take_oldest() noexcept;

  /// How many frames fit into a record of this arm: 1 to kMostFrames.
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
