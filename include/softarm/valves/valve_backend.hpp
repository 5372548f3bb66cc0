// What the valve driver asks of valve hardware, and how it finds the hardware that an experiment
// names.
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
  no_answer,        ///< too late, or none to what was asked
  exception_reply,  ///< the hardware answers, and refuses
  broken            ///< the connection is lost
};

/// What the hardware reports about the valves of all chambers.
struct ReadBack {
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

/// Valve hardware: set points out, measured pressures in. A back end moves numbers; what they may
/// be, and what to do when something fails, is decided by ValveGuard.
///
/// All calls come from one thread. They neither throw nor allocate, and they return within
/// `response_timeout_s` (`connect`: `connect_timeout_s`), whatever the hardware does: who waits
/// longer holds up the command that vents. Pressures have one entry per chamber, in the order of
/// the command, in bar.
class ValveBackend {
 public:
  virtual ~ValveBackend() = default;

  /// Opens the connection, after closing one that is open. False: `error` has the reason.
  virtual bool connect() noexcept = 0;
  virtual void close() noexcept = 0;
  virtual bool is_open() const noexcept = 0;

  /// What `secure` achieved.
  struct Secured {
    LinkResult result;
    bool confirmed;  ///< the time-out reads back as it was set
  };
  /// Sets the time after which the hardware vents by itself when it hears nothing
  /// (`failsafe_timeout_s`), and reads it back. No pressure is written before it is confirmed: the
  /// arm would keep it when the driver dies. Hardware without such a time-out cannot be driven.
  virtual Secured secure() noexcept = 0;

  /// @param set_points_bar each in [0, max_pressure_bar]
  virtual LinkResult write(const Eigen::VectorXd& set_points_bar) noexcept = 0;
  /// Fills `read_back`, which is unspecified unless ok. What is not a finite number counts as no
  /// answer.
  virtual LinkResult read(ReadBack& read_back) noexcept = 0;

  /// Why the last call that failed did; valid until the next call.
  virtual const char* error() const noexcept = 0;
  /// Where the hardware is, for people and for the lock that keeps a second driver away from it.
  virtual std::string address() const = 0;
  /// What a user should know at the start; empty: nothing.
  virtual std::string warning() const { return ""; }
};

/// Makes a back end. It checks the settings that it uses.
/// @throws std::invalid_argument "KEY: expected X, got Y"
using ValveBackendFactory = std::function<std::unique_ptr<ValveBackend>(
    const ValveDriverSettings& settings, double max_pressure_bar)>;

/// Adds a back end under a name that `valves.backend` of an experiment may have. To be called
/// before the driver starts. @throws std::invalid_argument if the name is taken
void add_valve_backend(const std::string& name, ValveBackendFactory make);

/// The one line that a class of your own takes, beside it:
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

/// The names that are known in this program: "modbus" and those registered.
std::vector<std::string> valve_backend_names();

/// The back end that `settings.backend` names.
/// @throws std::invalid_argument as the factory does, or if there is none of that name
std::unique_ptr<ValveBackend> make_valve_backend(const ValveDriverSettings& settings,
                                                 double max_pressure_bar);

}  // namespace softarm
