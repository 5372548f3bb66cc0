// softarm replay: a log of any messages. Records get the digest they should have, or nothing but
// the digest would ever be tested.
#include <sstream>

#include "fuzz/target.hpp"
#include "softarm/recording/replay.hpp"
#include "softarm/transport/settings.hpp"
#include "unit/config/config_files.hpp"
#include "unit/recording/recorded_log.hpp"

namespace softarm::test {
namespace {

constexpr std::size_t kDigest = 8;

const Experiment& replay_experiment() {
  static const Experiment loaded = load_experiment(kConfigFolder / "one_segment.yaml");
  return loaded;
}

void put_digest(Bytes& record) {
  if (record.size() < kDigest) return;
  std::uint64_t digest = 14695981039346656037ull;  // FNV-1a, as in lcmtypes/tick_record_t.lcm
  for (std::size_t k = 0; k < record.size() - kDigest; ++k)
    digest = (digest ^ std::to_integer<std::uint64_t>(record[k])) * 1099511628211ull;
  for (std::size_t k = 0; k < kDigest; ++k)
    record[record.size() - 1 - k] = static_cast<std::byte>(digest >> (8 * k) & 0xff);
}

}  // namespace

void run_replay(std::span<const std::byte> input) {
  std::istringstream stream(to_text(input));
  EventLogReader log(stream);
  Replay replay(replay_experiment(), "this build", true);
  std::int64_t events = 0;
  Bytes record;
  for (LogEvent event; log.next(event); ++events) {
    if (event.channel == replay_experiment().transport.lcm.tick_channel) {
      record = to_bytes(event.data);
      put_digest(record);
      event.data = record;
    }
    replay.take(event);
  }
  replay.finish();
  const ReplaySummary& summary = replay.summary();
  require(summary.ticks + summary.malformed <= events, "an event is one tick at most");
  require(summary.records.compared <= summary.ticks, "a tick is compared once");
  require(summary.records.different <= summary.records.compared, "what differs was compared");
  require(summary.missing_ticks >= summary.gap_count, "a gap is one tick at least");
}

std::vector<Bytes> replay_seeds() {
  LogBytes run, lossy;
  record_run(replay_experiment(), 0.01, false, run);
  record_run(replay_experiment(), 0.02, false, lossy,
             {[](auto tick, auto) { return tick % 3 != 0; }});
  return {to_bytes(run.bytes), to_bytes(lossy.bytes)};
}

std::vector<std::string> replay_words() {
  const LcmSettings lcm;
  return {lcm.tick_channel,
          lcm.status_channel,
          lcm.command_channel,
          "\xED\xA1\xDA\x01",
          std::string("\x7f\xff\xff\xff\xff\xff\xff\xff", 8),
          std::string("\x80\0\0\0\0\0\0\0", 8),
          std::string(8, '\0')};
}

}  // namespace softarm::test
