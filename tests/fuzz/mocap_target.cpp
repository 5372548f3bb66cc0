// Every motion-capture source, by name: whatever the bytes, a format keeps within what it declares,
// and what it accepts it can send again.
#include <algorithm>
#include <memory>

#include "fuzz/same_body.hpp"
#include "fuzz/target.hpp"
#include "softarm/transport/mocap_source.hpp"

namespace softarm::test {
namespace {

/// One source with everything behind it; the first byte of an input chooses.
struct Source {
  explicit Source(const MocapSourceKind& kind) : format(kind.make()) {
    TransportSettings transport;
    transport.mocap.source = kind;
    transport.bodies = {.base_id = -1,
                        .segment_ids = {1, 2},
                        .segment_marker_frames = {{.name = "a"}, {.name = "b"}}};
    ArmParameters arm;
    arm.segments.resize(2);
    source = std::make_unique<MocapSource>(transport, SafetySettings{}, arm);
  }

  std::unique_ptr<MocapFormat> format;
  std::unique_ptr<MocapSource> source;
  SentFrame sent, again;
};

std::vector<std::unique_ptr<Source>>& sources() {
  static std::vector<std::unique_ptr<Source>> all = [] {
    std::vector<std::unique_ptr<Source>> made;
    for (const MocapSourceKind& kind : mocap_sources().all())
      made.push_back(std::make_unique<Source>(kind));
    return made;
  }();
  return all;
}

}  // namespace

void run_mocap(std::span<const std::byte> input) {
  if (input.empty()) return;
  const auto choice = std::to_integer<std::size_t>(input.front());
  Source& it = *sources()[choice % sources().size()];
  const auto bytes = input.subspan(1);
  static std::int64_t now_ns = 0;
  now_ns += 5'000'000;
  MocapFrame frame;
  const MocapReceipt receipt = it.source->take(choice % 3, bytes, now_ns, frame);
  it.source->overdue(now_ns, frame);
  const bool accepted = it.format->decode(bytes, it.sent);
  require(accepted || receipt == MocapReceipt::malformed, "a source takes what its format accepts");
  require(receipt != MocapReceipt::frame || (frame.segments == 2 && frame.capture_ns <= now_ns),
          "a frame is the arm's, and not of the future");
  if (!accepted) return;
  require(it.sent.bodies <= SentFrame::kMostBodies, "bodies stay within their capacity");
  require(it.format->decode(it.format->encode(it.sent), it.again), "what was accepted can be sent");
  // qtm sends matrices: its target compares them.
  if (choice % sources().size() == mocap_sources().index("qtm")) return;
  require(std::equal(it.sent.body.begin(), it.sent.body.begin() + it.sent.bodies,
                     it.again.body.begin(), it.again.body.begin() + it.again.bodies, same_body),
          "what is sent again is the same");
}

std::vector<Bytes> mocap_seeds() {
  std::vector<Bytes> seeds;
  SentFrame frame;
  frame.frame_number = 7;
  frame.sender_time_us = 1'000'000;
  for (std::size_t k = 0; k < sources().size(); ++k) {
    const bool one = mocap_sources().all()[k].channel_per_body;
    frame.bodies = one ? 1 : 2;
    for (std::size_t i = 0; i < frame.bodies; ++i)
      frame.body[i] = {
          static_cast<std::int32_t>(i + 1), true, {0.1, 0.2, 0.3}, {1.0, 0.0, 0.0, 0.0}};
    const auto bytes = sources()[k]->format->encode(frame);
    Bytes seed = {static_cast<std::byte>(k)};
    seed.insert(seed.end(), bytes.begin(), bytes.end());
    seeds.push_back(seed);
  }
  return seeds;
}

}  // namespace softarm::test
