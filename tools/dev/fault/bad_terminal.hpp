// A valve terminal on Modbus TCP that misbehaves on request, with simulated valves behind it.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <span>
#include <thread>
#include <utility>
#include <vector>

#include "softarm/base/clock.hpp"
#include "softarm/base/time.hpp"
#include "softarm/valves/modbus_server.hpp"
#include "softarm/valves/register_map.hpp"
#include "softarm/valves/simulated_terminal.hpp"

namespace softarm {

/// What happens to set points that are written.
enum class Writes {
  obeyed,
  refused,
  ignored,  ///< although acknowledged
  stuck     ///< read back as written, but the valves stay where they are
};

/// The worst of its kind as to its time-out: whatever is asked of it keeps its outputs, reads and
/// refused requests too. Its valves follow with a lag of 20 ms.
class BadTerminal : private RegisterBank {
 public:
  explicit BadTerminal(int valves, RegisterMap map = register_preset(TerminalKind::cpx_vppm))
      : map_(std::move(map)),
        order_(first_numbers(valves)),
        terminal_(map_, order_),
        kept_(terminal_.registers().begin(), terminal_.registers().end()),
        bar_(Eigen::VectorXd::Zero(valves)),
        thread_([this](const std::stop_token& stop) { run(stop); }) {}
  ~BadTerminal() override {
    thread_.request_stop();
    thread_.join();
  }

  int port() const { return server_.port(); }
  /// The largest pressure behind the valves.
  double pressure_bar() const { return pressure_bar_; }
  int timeout_ms() const { return timeout_ms_; }

  std::atomic<Writes> writes{Writes::obeyed};
  /// As another master would: its outputs stay for ever from now on.
  void lose_timeout() { loses_timeout_ = true; }
  mutable std::atomic<int> requests{0};  ///< of all clients; a test may set it

 private:
  static std::vector<int> first_numbers(int count) {
    std::vector<int> numbers;
    for (int k = 0; k < count; ++k) numbers.push_back(k);
    return numbers;
  }

  std::span<std::uint16_t, 65536> registers() noexcept override { return terminal_.registers(); }
  bool readable(int address, int count) const noexcept override {
    asked();
    return terminal_.readable(address, count);
  }
  bool writable(int address, int count) const noexcept override {
    asked();
    return terminal_.writable(address, count) &&
           (writes != Writes::refused || address == map_.timeout_address);
  }
  void served(int address, int count) noexcept override {
    if (count == 0) return;
    const auto all = terminal_.registers();
    if (writes == Writes::ignored && address != map_.timeout_address)
      std::copy(kept_.begin(), kept_.end(), all.begin());
    std::copy(all.begin(), all.end(), kept_.begin());
  }
  void asked() const noexcept {
    ++requests;
    fed_ns_ = monotonic_now_ns();
  }

  void run(const std::stop_token& stop) {
    constexpr std::int64_t kStep_ns = 2'000'000;
    while (!stop.stop_requested()) {
      const std::int64_t end_ns = monotonic_now_ns() + kStep_ns;
      while (server_.wait_until(end_ns)) {
        terminal_.measure(bar_);
        server_.serve(*this);
      }
      if (loses_timeout_.exchange(false)) {
        const auto at = static_cast<std::size_t>(map_.timeout_address);
        for (int k = 0; k < map_.timeout_words; ++k)
          terminal_.registers()[at + static_cast<std::size_t>(k)] = 0;
      }
      const double timeout_s = terminal_.timeout_s();
      if (timeout_s > 0.0 && monotonic_now_ns() - fed_ns_ > to_ns(timeout_s)) {
        terminal_.reset_outputs();
        const auto all = terminal_.registers();
        std::copy(all.begin(), all.end(), kept_.begin());
      }
      if (writes != Writes::stuck) bar_ += 0.1 * (terminal_.set_points_bar() - bar_);
      pressure_bar_ = bar_.maxCoeff();
      timeout_ms_ = static_cast<int>(1e3 * timeout_s + 0.5);
    }
  }

  RegisterMap map_;
  std::vector<int> order_;
  SimulatedTerminal terminal_;
  std::vector<std::uint16_t> kept_;  ///< registers after the last write that was obeyed
  Eigen::VectorXd bar_;
  ModbusServer server_{0};
  mutable std::int64_t fed_ns_ = 0;
  std::atomic<bool> loses_timeout_{false};
  std::atomic<double> pressure_bar_{0.0};
  std::atomic<int> timeout_ms_{0};
  std::jthread thread_;
};

}  // namespace softarm
