#include "apps/softarm/closed_loop_run.hpp"

#include <fmt/format.h>

#include <cmath>

#include "apps/child_process.hpp"
#include "apps/progress.hpp"
#include "apps/signals.hpp"
#include "softarm/client/arm_client.hpp"
#include "softarm/config/load.hpp"
#include "softarm/recording/status_record.hpp"

namespace softarm {
namespace {

namespace fs = std::filesystem;
constexpr double kStart_s = 10.0;  ///< until the first status
constexpr double kLook_s = 0.1;
constexpr double kSettle_s = 1.0;        ///< of ACTIVE before errors count
constexpr double kLongestWait_s = 20.0;  ///< not ACTIVE, in all

/// Errors of the estimate, status by status.
struct Errors {
  double sum = 0.0;
  std::int64_t count = 0;

  void add(const ArmStatus& status, double active_s) {
    if (status.shadow || status.mode != Mode::active || active_s < kSettle_s) return;
    const double square = (status.reference_u_rad - status.u_rad).squaredNorm();
    if (!std::isfinite(square)) return;
    sum += square / status.segments();
    ++count;
  }
  double rms() const { return count > 0 ? std::sqrt(sum / static_cast<double>(count)) : NAN; }
};

/// Arms, and waits for `duration_s` of ACTIVE. Returns why not.
std::string follow(OperatorClient& client, ChildProcess& daemon, StatusRecord& record,
                   double duration_s) {
  for (double left_s = kStart_s; !client.wait_for_status(kLook_s); left_s -= kLook_s) {
    if (!daemon.runs()) return "softarmd has ended";
    if (left_s <= 0.0) return "softarmd gives no status";
  }
  if (client.request(OperatorRequest::arm) != RequestOutcome::done)
    return "softarmd does not arm; it is in " + client.daemon_text();
  Progress progress(true);
  const double begin_s = record.time_s();
  while (record.active_s() < duration_s) {
    if (stop_requested != 0) return "stopped";
    if (!daemon.runs()) return "softarmd has ended";
    if (!record.failure().empty()) return record.failure();
    client.wait_for_status(0.5);
    const Mode mode = client.status()->mode;
    if (mode == Mode::fault || (mode == Mode::vent && record.active_s() > 0.0))
      return "the arm was vented: " + client.daemon_text();
    if (record.time_s() - begin_s - record.active_s() > kLongestWait_s)
      return "the arm does not become ACTIVE; softarmd is in " + client.daemon_text();
    progress.update(
        fmt::format("{} {:.0f} of {:.0f} s", client.daemon_text(), record.active_s(), duration_s));
  }
  return {};
}

}  // namespace

ClosedLoopRun run_closed_loop(const fs::path& config, const fs::path& folder, double duration_s) {
  const Experiment experiment = load_experiment(config);
  fs::create_directories(folder);
  StatusRecord record(experiment, folder);
  Errors errors;
  OperatorClient client(experiment.transport.lcm);
  client.record(folder / "run.log");
  client.on_message(
      [&](const ArmMessage& message) { record.take(message.channel, message.bytes); });
  client.on_status([&](const ArmStatus& status) { errors.add(status, record.active_s()); });
  ClosedLoopRun run;
  {
    ChildProcess daemon(program_beside_this("softarmd"), {config.string()}, folder / "softarmd.txt",
                        SIGTERM);  // it ends when the arm is vented
    run.failure = follow(client, daemon, record, duration_s);
    client.request(OperatorRequest::disarm);
  }
  client.update(client.now_ns());
  client.stop_recording();
  record.close();
  run.error_rms_rad = errors.rms();
  run.table = record.table();
  return run;
}

}  // namespace softarm
