// softarm import: a map, a byte 0, a table. What is written is a whole log with all its rows.
#include <fstream>

#include "fuzz/memory_file.hpp"
#include "fuzz/target.hpp"
#include "softarm/config/config_error.hpp"
#include "softarm/recording/recording_import.hpp"
#include "softarm/transport/event_log.hpp"

namespace softarm::test {
namespace {

constexpr const char* kMap = R"(time: t
time_unit_s: 0.001
up: y
frame_period_s: 0.01
base: {id: 0, position: ax ay az, orientation: aq ar as at}
segments:
  - {id: 1, position: bx by bz, orientation: bq br bs bt, length_m: 0.3}
rest: {from_s: 0, to_s: 0.5, base_rotation: hanging}
pressures: {unit_bar: 0.1, commanded: p, measured: m}
)";

constexpr const char* kTable = R"(t,ax,ay,az,aq,ar,as,at,bx,by,bz,bq,br,bs,bt,p,m
0,0,0,1,0,0,0,1,0,-0.3,1,0,0,0,1,0,0
10,0,0,1,0,0,0,1,0,-0.3001,1,0,0,0,1,1,0.5
20,,,,,,,,0,-0.3001,1,0,0,0.01,1,1,nan
)";

void check_log(const MemoryFile& out, const ImportSummary& summary) {
  std::ifstream stream(out.path(), std::ios::binary);
  EventLogReader log(stream);
  std::int64_t events = 0;
  for (LogEvent event; log.next(event);) ++events;
  require(log.damage_count() == 0, "the log is whole");
  require(events >= summary.rows && events <= 3 * summary.rows, "every row is in the log");
  require(summary.frames + summary.repeated == summary.rows, "a row is a frame or its repetition");
}

}  // namespace

void run_recording(std::span<const std::byte> input) {
  static const MemoryFile map, table, out;
  const auto cut = std::find(input.begin(), input.end(), std::byte{0});
  map.write(input.first(static_cast<std::size_t>(cut - input.begin())));
  table.write(cut == input.end()
                  ? std::span<const std::byte>()
                  : input.subspan(static_cast<std::size_t>(cut - input.begin()) + 1));
  try {
    const MappedTable recording = read_mapped_table(table.path(), map.path());
    check_log(out, import_recording(recording, out.path()));
  } catch (const BrokenProperty&) {
    throw;
  } catch (const std::runtime_error& error) {
    require(*error.what() != '\0', "an error says what is wrong");
  }
}

std::vector<Bytes> recording_seeds() { return {to_bytes(std::string(kMap) + '\0' + kTable)}; }

std::vector<std::string> recording_words() {
  return {"nan",        "inf",        "1e308", "-1e308",           "1e-320",       "4e9",  "0",
          "\n",         ",",          ";",     "separator: \";\"", "\xef\xbb\xbf", "rest", "wxyz",
          "standing\n", "\n30,0,0,1", "-",     "time_unit_s: 1e4"};
}

}  // namespace softarm::test
