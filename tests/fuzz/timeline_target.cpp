// The time line of a log: whatever stamps and clocks do, it never runs back and no message moves it
// on by more than the longest gap.
#include <algorithm>

#include "fuzz/target.hpp"
#include "softarm/transport/log_timeline.hpp"

namespace softarm::test {
namespace {

/// Steps of the two clocks that an input chooses from, in us.
constexpr std::int64_t kSteps_us[] = {
    0,          1,  1'000,      2'000,       5'000,       100'000,    300'001,     2'000'000,
    60'000'000, -1, -2'000'000, -60'000'000, 600'000'000, kLatest_us, -kLatest_us, 86'400'000'000};

}  // namespace

/// Every two bytes are a message: its channel, and by how much stamp and sender's clock have moved.
void run_timeline(std::span<const std::byte> input) {
  static const TransportSettings transport;
  LogTimeline line(transport);
  const std::string channels[] = {transport.lcm.command_channel, transport.lcm.status_channel,
                                  transport.lcm.tick_channel, "ANOTHER"};
  std::int64_t stamp_us = 1'700'000'000'000'000, own_us[4] = {}, newest_ns = -1;
  std::vector<std::byte> data(64);
  for (std::size_t k = 0; k + 1 < input.size(); k += 2) {
    const auto choice = std::to_integer<std::size_t>(input[k]);
    const auto steps = std::to_integer<std::size_t>(input[k + 1]);
    const std::size_t channel = choice % 4;
    stamp_us = std::clamp(stamp_us + kSteps_us[steps % 16], -kLatest_us, kLatest_us);
    own_us[channel] = std::clamp(own_us[channel] + kSteps_us[steps / 16], -kLatest_us, kLatest_us);
    for (const std::size_t at : {8U, 16U, 32U})
      for (std::size_t byte = 0; byte < 8; ++byte)
        data[at + byte] = static_cast<std::byte>(own_us[channel] >> (56 - 8 * byte) & 0xff);
    data.resize(choice & 128 ? 64 : 64 - choice / 4 % 60);
    const auto arrival_ns = line.arrival_ns({.position = static_cast<std::int64_t>(k),
                                             .number = 0,
                                             .time_us = stamp_us,
                                             .channel = channels[channel],
                                             .data = data});
    data.resize(64);
    require(arrival_ns.has_value() == (channel < 3 && stamp_us >= 0), "who has a time has one");
    if (!arrival_ns) continue;
    require(newest_ns < 0 || *arrival_ns >= newest_ns, "the line never runs back");
    require(newest_ns < 0 || *arrival_ns - newest_ns <= LogTimeline::kLongestGap_ns,
            "no gap is longer than the longest");
    newest_ns = *arrival_ns;
  }
  require(line.breaks().size() <= LogTimeline::kBreaksKept, "breaks are bounded");
  require(line.text().empty() == line.breaks().empty(), "breaks are reported");
}

std::vector<Bytes> timeline_seeds() {
  Bytes steady, stepped;
  for (int k = 0; k < 200; ++k) {
    const auto channel = static_cast<std::byte>(128 + k % 3);
    steady.insert(steady.end(), {channel, std::byte{0x33}});
    stepped.insert(stepped.end(), {channel, k % 50 == 49 ? std::byte{0x3a} : std::byte{0x33}});
  }
  return {steady, stepped};
}

}  // namespace softarm::test
