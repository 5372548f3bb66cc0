// Interface between the valve driver and valve hardware, and the registry of back ends by name.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "softarm/valves/settings.hpp"

namespace softarm {

/// How a request to the hardware ended.
enum class LinkResult {
  ok,
  no_answer,        ///< none in time, or not to this request
  exception_reply,  ///< the hardware refused the request
  broken            ///< the connection is lost
};

/// What the hardware reports about the valves of all chambers.
struct ReadBack {
  /// For `chambers` chambers, all pressures zero.
  explicit ReadBack(int chambers)
      : actual_bar(Eigen::VectorXd::Zero(chambers)),
        echo_bar(actual_bar),
        diagnosis(static_cast<std::size_t>(chambers), 0) {}

  Eigen::VectorXd actual_bar;  ///< measured
  Eigen::VectorXd echo_bar;    ///< set points as the hardware has them, if `has_echo`
  bool has_echo = false;
  double resolution_bar = 1e-3;          ///< an echo of zero is at most this
  std::vector<std::uint16_t> diagnosis;  ///< one per chamber, faults only; 0: none
  bool ready = true;                     ///< every valve regulates its pressure
};

/// Valve hardware: set points out, measured pressures in. A back end only transfers numbers;
/// ValveGuard decides which values are allowed and what to do on a failure.
///
/// All calls come from one thread. They neither throw nor allocate, and they return within
/// `response_timeout_s` (`connect`: `connect_timeout_s`), whatever the hardware does: a longer wait
/// would delay the command that vents. Pressures have one entry per chamber, in the order of the
/// command, in bar.
class ValveBackend {
 public:
  virtual ~ValveBackend() = default;

  /// Opens the connection, closing an open one first. False: `error` has the reason.
  virtual bool connect() noexcept = 0;
  /// Closes the connection, if it is open.
  virtual void close() noexcept = 0;
  /// Whether the connection is open.
  virtual bool is_open() const noexcept = 0;

  /// Result of `secure`.
  struct Secured {
    LinkResult result;
    bool confirmed;  ///< the time-out reads back as it was set
  };
  /// Sets the time without requests after which the hardware vents by itself
  /// (`failsafe_timeout_s`), and reads it back. No pressure is written before it is confirmed:
  /// otherwise the arm would stay pressurised if the driver crashed. Hardware without such a
  /// time-out cannot be driven.
  virtual Secured secure() noexcept = 0;

  /// Reads that time-out back, about once a second: another master may have changed it. Hardware
  /// whose time-out nobody else can change needs no override.
  virtual Secured check() noexcept { return {LinkResult::ok, true}; }

  /// Whether `read` returns the answer to the last `write`. Otherwise it asks the hardware, and what
  /// it holds is known before every write.
  virtual bool answers_writes() const noexcept { return false; }

  /// Called once a cycle, after `read` except in the first cycle.
  /// @param set_points_bar each in [0, max_pressure_bar]
  virtual LinkResult write(const Eigen::VectorXd& set_points_bar) noexcept = 0;
  /// Fills `read_back`, which is unspecified unless ok. A value that is not finite counts as no
  /// answer.
  virtual LinkResult read(ReadBack& read_back) noexcept = 0;

  /// Reason of the last failure; valid until the next call.
  virtual const char* error() const noexcept = 0;
  /// Address of the hardware, for messages and for the lock that excludes a second driver.
  virtual std::string address() const = 0;
  /// Warning to print at the start; empty: none.
  virtual std::string warning() const { return ""; }
};

/// Makes a back end. It checks the settings that it uses.
/// @throws std::invalid_argument "KEY: expected X, got Y"
using ValveBackendFactory = std::function<std::unique_ptr<ValveBackend>(
    const ValveDriverSettings& settings, double max_pressure_bar)>;

/// Adds a back end under a name that `valves.backend` of an experiment may have. Call it before the
/// driver starts. @throws std::invalid_argument if the name is taken
void add_valve_backend(const std::string& name, ValveBackendFactory make);

/// Registers a back end class under a name, in one line beside the class:
///
///   const softarm::ValveBackendRegistration<MyBoard> kRegistration("my_board");
///
/// Its constructor has one parameter, const ValveDriverSettings&.
template <class Backend>
struct ValveBackendRegistration {
  explicit ValveBackendRegistration(const std::string& name) {
    add_valve_backend(name, [](const ValveDriverSettings& settings, double) {
      return std::make_unique<Backend>(settings);
    });
  }
};

/// The names known in this program: "modbus" and those registered.
std::vector<std::string> valve_backend_names();

/// The back end that `settings.backend` names.
/// @throws std::invalid_argument as the factory does, or if no back end has that name
std::unique_ptr<ValveBackend> make_valve_backend(const ValveDriverSettings& settings,
                                                 double max_pressure_bar);

}  // namespace softarm
