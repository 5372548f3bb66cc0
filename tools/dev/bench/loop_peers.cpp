#include "dev/bench/loop_peers.hpp"

#include <signal.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstring>
#include <new>
#include <softarm_messages/pressure_command_t.hpp>
#include <stdexcept>
#include <vector>

#include "softarm/base/clock.hpp"
#include "softarm/base/realtime.hpp"
#include "softarm/client/arm_client.hpp"
#include "softarm/transport/lcm_node.hpp"

namespace softarm {
namespace {

/// Where the first field after a message's hash is.
constexpr std::size_t kNumberAt = 8;

}  // namespace

ForkedPeer::ForkedPeer(const std::function<void()>& body) : pid_(fork()) {
  if (pid_ < 0) throw std::runtime_error("cannot start a process");
  if (pid_ > 0) return;
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  for (const int number : {SIGTERM, SIGINT, SIGHUP}) ::signal(number, SIG_DFL);
  try {
    body();
  } catch (...) {  // the process that waits for an answer reports that none came
  }
  _exit(1);
}

ForkedPeer::~ForkedPeer() {
  kill(pid_, SIGKILL);
  waitpid(pid_, nullptr, 0);
}

void echo_forever(const std::string& url, int chambers, const RealtimeSettings& realtime) {
  apply_realtime_settings(realtime);
  RealtimeSettings below = realtime;
  below.priority = std::max(1, realtime.priority - 1);
  apply_realtime_settings(below);
  softarm_messages::pressure_command_t command{};
  command.num_chambers = static_cast<std::int16_t>(chambers);
  command.pressure_bar.assign(static_cast<std::size_t>(chambers), 0.0F);
  std::vector<std::byte> answer(static_cast<std::size_t>(command.getEncodedSize()));
  command.encode(answer.data(), 0, static_cast<int>(answer.size()));
  LcmNode node(url);
  node.subscribe(kEchoRequest, 64, [&](const ReceivedMessage& packet) {
    if (packet.bytes.size() < kNumberAt + 8) return;
    std::copy_n(packet.bytes.begin() + kNumberAt, 8, answer.begin() + kNumberAt);
    node.publish_encoded(kEchoAnswer, answer);
  });
  apply_realtime_settings(realtime);
  while (true) node.wait_until(monotonic_now_ns() + 1'000'000'000);
}

void answer_states_forever(const Experiment& experiment, const RealtimeSettings& realtime) {
  RealtimeSettings below = realtime;
  below.priority = std::max(1, realtime.priority - 1);
  apply_realtime_settings(below);
  ArmClient client(experiment);
  const Eigen::VectorXd zero = Eigen::VectorXd::Zero(experiment.arm.dof());
  client.on_law_request([&](const LawRequest& request) { client.answer_force(request, zero); });
  while (true) client.update(monotonic_now_ns() + 1'000'000'000);
}

SharedWakeUps::SharedWakeUps(std::size_t capacity)
    : bytes_(sizeof(State) + capacity * sizeof(std::int64_t)), capacity_(capacity) {
  void* const memory = mmap(nullptr, bytes_, PROT_READ | PROT_WRITE,
                            MAP_SHARED | MAP_ANONYMOUS | MAP_POPULATE, -1, 0);
  if (memory == MAP_FAILED) throw std::runtime_error("no shared memory");
  state_ = new (memory) State;
  lateness_ns_ = reinterpret_cast<std::int64_t*>(state_ + 1);
}

SharedWakeUps::~SharedWakeUps() { munmap(state_, bytes_); }

void SharedWakeUps::sleep_forever(std::int64_t period_ns, const RealtimeSettings& realtime) {
  apply_realtime_settings(realtime);
  while (state_->first_ns == 0) sleep_until_ns(monotonic_now_ns() + 1'000'000);
  PeriodicDeadline deadline(period_ns, state_->first_ns);
  while (true) {
    sleep_until_ns(deadline.next_ns());
    const std::int64_t woken_ns = monotonic_now_ns();
    const std::size_t count = state_->count;
    if (count < capacity_) {
      lateness_ns_[count] = woken_ns - deadline.next_ns();
      state_->count = count + 1;
    }
    state_->missed += deadline.advance(monotonic_now_ns());
  }
}

}  // namespace softarm
