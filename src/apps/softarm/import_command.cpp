// softarm import: converts a laboratory's table to a log of our messages.
#include <fmt/format.h>

#include <memory>

#include "apps/softarm/commands.hpp"
#include "softarm/recording/map_proposal.hpp"
#include "softarm/recording/recording_import.hpp"

namespace softarm {
namespace {

struct ImportOptions {
  std::string table, map, out, frames_from, frames_map;
};

void run_import(const ImportOptions& options) {
  if (options.map.empty()) {
    fmt::print("{}", propose_map(read_csv(options.table)));
    return;
  }
  const MappedTable recording = read_mapped_table(options.table, options.map);
  const bool shared = !options.frames_from.empty();
  const ImportSummary summary =
      shared ? import_recording(recording,
                                marker_frames(read_mapped_table(
                                    options.frames_from,
                                    options.frames_map.empty() ? options.map : options.frames_map)),
                                options.out)
             : import_recording(recording, options.out);
  fmt::print("{} rows over {:.3f} s: {} frames, {} repeated, {} missing, {} with a body not seen\n",
             summary.rows, summary.duration_s, summary.frames, summary.repeated, summary.missing,
             summary.unseen);
  fmt::print("longest gap between frames {:.3f} s\n", summary.longest_gap_s);
  if (recording.map.rest || shared) {
    fmt::print("rest pose from {} frames{}, still within {:.2f} mm\n", summary.rest_frames,
               shared ? " of " + options.frames_from : "", 1e3 * summary.rest_spread_m);
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
  auto* from = command
                   ->add_option("--frames-from", options->frames_from,
                                "another table of this arm: its rest window is the zero of both")
                   ->needs(map);
  command->add_option("--frames-map", options->frames_map, "the map of that table (default: MAP)")
      ->needs(from);
  command->callback([options] { run_import(*options); });
}

}  // namespace softarm
