// Valve hardware that does what a test asks for, and keeps what it was asked to do.
#pragma once

#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "softarm/valves/valve_backend.hpp"

namespace softarm::test {

/// What is shared between a test and the back end that a driver owns.
struct FakeHardware {
  bool reachable = true, open = false, confirms = true, has_nan = false, ignores_writes = false,
       keeps_failsafe = true;
  LinkResult secure_result = LinkResult::ok, write_result = LinkResult::ok,
             read_result = LinkResult::ok;
  std::vector<double> written_bar;  ///< the last set points that arrived
  std::vector<std::string> calls;   ///< of everything, in order
  std::function<void()> during_write = [] {};
};

class FakeBackend : public ValveBackend {
 public:
  explicit FakeBackend(FakeHardware& hardware) : it_(hardware) {}

  bool connect() noexcept override {
    it_.calls.emplace_back("connect");
    return it_.open = it_.reachable;
  }
  void close() noexcept override {
    it_.calls.emplace_back("close");
    it_.open = false;
  }
  bool is_open() const noexcept override { return it_.open; }
  Secured secure() noexcept override {
    it_.calls.emplace_back("secure");
    return {it_.secure_result, it_.confirms};
  }
  Secured check() noexcept override { return {LinkResult::ok, it_.keeps_failsafe}; }
  LinkResult write(const Eigen::VectorXd& set_points_bar) noexcept override {
    it_.calls.emplace_back("write");
    it_.during_write();
    if (!it_.ignores_writes) it_.written_bar.assign(set_points_bar.begin(), set_points_bar.end());
    return it_.write_result;
  }
  LinkResult read(ReadBack& read_back) noexcept override {
    it_.calls.emplace_back("read");
    for (std::size_t i = 0; i < it_.written_bar.size(); ++i)
      read_back.actual_bar[static_cast<Eigen::Index>(i)] = it_.written_bar[i];
    if (it_.has_nan) read_back.actual_bar[0] = std::nan("");
    return it_.read_result;
  }
  const char* error() const noexcept override { return "a fault of the test"; }
  std::string address() const override { return "nowhere"; }

 private:
  FakeHardware& it_;
};

}  // namespace softarm::test
