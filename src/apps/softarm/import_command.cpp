// softarm import: converts a laboratory's table to a log of our messages.
#include <fmt/format.h>

#include <memory>

#include "apps/softarm/commands.hpp"
#include "softarm/recording/map_proposal.hpp"
#include "softarm/recording/recording_import.hpp"

namespace softarm {
namespace {

struct ImportOptions {
  std::string table, map, out;
};

void run_import(const ImportOptions& options) {
  if (options.map.empty()) {
    fmt::print("{}", propose_map(read_csv(options.table)));
    return;
  }
  const MappedTable recording = read_mapped_table(options.table, options.map);
  const ImportSummary summary = import_recording(recording, options.out);
  fmt::print("{} rows over {:.3f} s: {} frames, {} repeated, {} missing, {} with a body not seen\n",
             summary.rows, summary.duration_s, summary.frames, summary.repeated, summary.missing,
             summary.unseen);
  fmt::print("longest gap between frames {:.3f} s\n", summary.longest_gap_s);
  if (recording.map.rest) {
    fmt::print("rest pose from {} frames, still within {:.2f} mm\n", summary.rest_frames,
               1e3 * summary.rest_spread_m);
  }
  fmt::print("{}\n", options.out);
}

}  // namespace

void add_import_command(CLI::App& app) {
  auto options = std::make_shared<ImportOptions>();
  CLI::App* command = app.add_subcommand("import", "Turn a recorded table into an LCM log");
  command->add_option("CSV", options->table, "the table, one row a sample")->required();
  auto* map = command->add_option("MAP", options->map,
                                  "what its columns mean, YAML; left out: print one, with the "
                                  "reason of every line");
  auto* out = command->add_option("--out", options->out, "the log to write")->needs(map);
  map->needs(out);
  command->callback([options] { run_import(*options); });
}

}  // namespace softarm
