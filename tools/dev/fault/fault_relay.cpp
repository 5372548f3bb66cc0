#include "dev/fault/fault_relay.hpp"

#include <algorithm>

#include "softarm/base/clock.hpp"
#include "softarm/base/realtime.hpp"
#include "softarm/transport/message_decoding.hpp"
#include "softarm/transport/settings.hpp"

namespace softarm {
namespace {

constexpr int kCapacity = 64;
constexpr std::int64_t kLookEvery_ns = 10'000'000;  ///< whether to stop

}  // namespace

FaultRelay::FaultRelay(const LcmSettings& lcm, const std::string& suffix, int fifo_priority,
                       const std::string& valves_channel)
    : lcm_(lcm), node_(lcm.url) {
  node_.subscribe(lcm_.mocap_channel + suffix, kCapacity, [this](const ReceivedMessage& packet) {
    if (!decode(packet.bytes, received_)) return;
    ++frames_received_;
    const std::lock_guard lock(mutex_);
    injector_.take(received_, monotonic_now_ns());
  });
  node_.subscribe(lcm_.measurement_channel + suffix, kCapacity,
                  [this](const ReceivedMessage& packet) {
                    if (!decode(packet.bytes, measurement_)) return;
                    const std::lock_guard lock(mutex_);
                    if (injector_.pass(measurement_))
                      node_.publish(lcm_.measurement_channel, measurement_);
                  });
  if (!valves_channel.empty())
    node_.subscribe(lcm_.command_channel, kCapacity,
                    [this, valves_channel](const ReceivedMessage& packet) {
                      if (!loses_commands_) node_.publish_encoded(valves_channel, packet.bytes);
                    });
  thread_ = std::jthread([this, fifo_priority](const std::stop_token& stop) {
    if (fifo_priority > 0) apply_realtime_settings({.fifo = true, .priority = fifo_priority});
    work(stop);
  });
}

void FaultRelay::set(const Fault& fault) {
  const std::lock_guard lock(mutex_);
  injector_.set(fault);
}

void FaultRelay::work(const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    std::int64_t wake_ns = monotonic_now_ns() + kLookEvery_ns;
    {
      const std::lock_guard lock(mutex_);
      wake_ns = std::min(wake_ns, injector_.next_due_ns());
    }
    node_.wait_until(wake_ns);
    send_what_is_due();
  }
}

void FaultRelay::send_what_is_due() {
  const std::lock_guard lock(mutex_);
  while (injector_.next(monotonic_now_ns(), sent_)) node_.publish(lcm_.mocap_channel, sent_);
}

}  // namespace softarm
