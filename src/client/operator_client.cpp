#include "softarm/client/operator_client.hpp"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "softarm/runtime/safety_monitor.hpp"
#include "softarm/transport/message_decoding.hpp"

namespace softarm {
namespace {

constexpr int kQueue = 1024;                       ///< messages of a channel between two rounds
constexpr std::int64_t kLook_ns = 10'000'000;      ///< longest single wait
constexpr std::int64_t kAskAgain_ns = 50'000'000;  ///< from one request to the next
constexpr std::int64_t kStatusCounts_ns = 1'000'000'000;

bool shows(const ArmStatus& status, OperatorRequest what) {
  switch (what) {
    case OperatorRequest::arm:
      return status.armed;
    case OperatorRequest::disarm:
      return !status.armed && status.mode != Mode::fault;
    case OperatorRequest::emergency_stop:
      return status.mode == Mode::fault && status.reason == Reason::emergency_stop;
  }
  return false;
}

}  // namespace

OperatorClient::OperatorClient(const LcmSettings& lcm, int segments, Clock clock)
    : lcm_(lcm), segments_(segments), clock_(std::move(clock)), node_(lcm.url) {
  listen(lcm_.status_channel, [this](const ArmMessage& message) { take_status(message); });
}

void OperatorClient::listen(const std::string& name, Handler handler) {
  const auto known = std::find_if(channels_.begin(), channels_.end(),
                                  [&](const Channel& each) { return each.name == name; });
  if (known != channels_.end()) {
    if (handler) known->handlers.push_back(std::move(handler));
    return;
  }
  const std::size_t index = channels_.size();
  node_.subscribe(name, kQueue, [this, index](const ReceivedMessage& packet) {
    received_.push_back(
        {index, {packet.bytes.begin(), packet.bytes.end()}, packet.arrival_ns, packet.stamp_us});
  });
  channels_.push_back({name, {}});
  if (handler) channels_.back().handlers.push_back(std::move(handler));
}

bool OperatorClient::update(std::int64_t until_ns) {
  return handle_until(monotonic_now_ns() + std::max<std::int64_t>(0, until_ns - now_ns()), kQueue);
}

bool OperatorClient::handle_until(std::int64_t end_ns, int most) {
  while (true) {
    const std::int64_t look_ns = std::min(end_ns, monotonic_now_ns() + kLook_ns);
    const bool any = node_.wait_until(look_ns);
    if (any) node_.drain(most - 1);
    const bool interrupted = !any && monotonic_now_ns() < look_ns;
    handle_round();
    if (any || interrupted || monotonic_now_ns() >= end_ns) return any;
  }
}

void OperatorClient::handle_round() {
  // Converts arrivals to our clock, which in tests is not that of the node.
  const std::int64_t monotonic_ns = monotonic_now_ns(), now_ns = this->now_ns();
  while (!received_.empty()) {
    const Received packet = std::move(received_.front());
    received_.pop_front();
    const Channel& channel = channels_[packet.channel];
    newest_arrival_ns_ = std::max(
        newest_arrival_ns_, now_ns - std::max<std::int64_t>(0, monotonic_ns - packet.arrival_ns));
    const ArmMessage message{.channel = channel.name,
                             .bytes = packet.bytes,
                             .arrival_ns = newest_arrival_ns_,
                             .wall_us = packet.wall_us};
    if (log_) log_->write(message.wall_us, message.channel, message.bytes);
    if (on_message_) on_message_(message);
    for (const Handler& handle : channel.handlers) handle(message);
  }
  after_round();
}

bool OperatorClient::wait_for(const std::function<bool()>& reached, double patience_s) {
  const std::int64_t end_ns = monotonic_now_ns() + to_ns(patience_s);
  while (!reached()) {
    const std::int64_t now_ns = monotonic_now_ns();
    if (now_ns >= end_ns) return false;
    handle_until(std::min(end_ns, now_ns + kLook_ns), 1);
  }
  return true;
}

bool OperatorClient::wait_for_status(double patience_s) {
  return wait_for([this, before = statuses_] { return statuses_ > before; }, patience_s);
}

void OperatorClient::take_status(const ArmMessage& message) {
  ArmStatus newest;
  if (!decode(message.bytes, newest)) return;
  if (segments_ > 0 && newest.segments() != segments_) return;
  if (on_status_) on_status_(newest);
  if (newest.shadow) return;
  status_ = std::move(newest);
  status_ns_ = message.arrival_ns;
  ++statuses_;
}

bool OperatorClient::daemon_armed() const {
  return status_ && now_ns() - status_ns_ <= kStatusCounts_ns && status_->may_pressurise();
}

std::string OperatorClient::daemon_text() const { return status_ ? status_->text() : "not heard"; }

bool OperatorClient::try_to_send(OperatorRequest what, std::int64_t number, std::int64_t nonce) {
  return node_.publish(
      lcm_.operator_channel,
      softarm_messages::operator_command_t{
          .sequence = number, .nonce = nonce, .request = static_cast<std::int8_t>(what)});
}

void OperatorClient::send(OperatorRequest what) {
  if (!try_to_send(what, next_sequence(), newest_nonce())) throw_unsent();
}

RequestOutcome OperatorClient::request(OperatorRequest what, double patience_s) {
  const std::int64_t number = next_sequence();
  update(now_ns());  // what came before is not an answer
  const std::int64_t before = statuses_;
  std::int64_t next_ns = 0;
  std::optional<std::int64_t> nonce;
  bool sent = false;
  const auto heard = [&] { return sent && statuses_ > before; };
  const auto understood = [&] {
    if (heard() && shows(*status_, what)) return true;
    if (!nonce && statuses_ > before) {
      nonce = status_->nonce;
      next_ns = 0;
    }
    if (const std::int64_t now_ns = monotonic_now_ns(); now_ns >= next_ns) {
      sent |= try_to_send(what, number, nonce.value_or(0));
      next_ns = now_ns + kAskAgain_ns;
    }
    return false;
  };
  if (wait_for(understood, patience_s)) return RequestOutcome::done;
  if (!sent) throw_unsent();
  return heard() ? RequestOutcome::refused : RequestOutcome::unheard;
}

void OperatorClient::send_go(bool go) {
  if (lcm_.deadman_channel.empty())
    throw std::logic_error("there is no dead-man input: lcm.deadman_channel is empty");
  publish(lcm_.deadman_channel,
          softarm_messages::deadman_t{.sequence = next_sequence(),
                                      .nonce = newest_nonce(),
                                      .go = static_cast<std::int8_t>(go ? 1 : 0)});
}

void OperatorClient::record(const std::filesystem::path& log) {
  log_.emplace(log);
  for (const std::string& channel :
       {lcm_.mocap_channel, lcm_.command_channel, lcm_.measurement_channel, lcm_.reference_channel,
        lcm_.operator_channel, lcm_.timing_channel, lcm_.observer_channel, lcm_.tick_channel,
        lcm_.valves_channel, lcm_.plant_channel, lcm_.deadman_channel})
    if (!channel.empty()) listen(channel, {});
}

void OperatorClient::stop_recording() {
  if (!log_) return;
  log_->close();
  log_.reset();
}

std::int64_t OperatorClient::next_sequence() {
  return sequence_ = std::max(sequence_ + 1, wall_now_ns());
}

void OperatorClient::throw_unsent() {
  throw TransportError("the message could not be sent: see tools/with_loopback_network --check");
}

}  // namespace softarm
