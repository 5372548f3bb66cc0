#include "apps/softarm/law_process.hpp"

#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstring>
#include <stdexcept>

#include "apps/python.hpp"
#include "softarm/transport/lcm_node.hpp"
#include "softarm/transport/message_decoding.hpp"

namespace softarm {

LawProcess::LawProcess(const std::string& law, const std::string& config,
                       const Experiment& experiment)
    : messages_(experiment, {}, false),
      received_{},
      buffer_(LcmNode::kLargestMessage),
      period_us_(1e6 / experiment.rate_hz) {
  int ends[2];
  if (::socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, ends) != 0)
    throw std::runtime_error(std::string("no socket for the law: ") + std::strerror(errno));
  pid_ = ::fork();
  if (pid_ == 0) {
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    ::fcntl(ends[1], F_SETFD, 0);
    become_python("softarm",
                  {"-m", "softarm.law", law, config, "--socket", std::to_string(ends[1])});
    ::_exit(127);
  }
  ::close(ends[1]);
  socket_ = ends[0];
  if (pid_ < 0)
    throw std::runtime_error(std::string("no process for the law: ") + std::strerror(errno));
}

LawProcess::~LawProcess() {
  if (socket_ >= 0) ::close(socket_);  // it ends
  if (pid_ > 0) ::waitpid(pid_, nullptr, 0);
}

bool LawProcess::answer(const TickOutput& output, LawInput& answer) {
  messages_.set_law_state(++ticks_, output);
  auto& state = messages_.law_state;
  state.time_us = static_cast<std::int64_t>(period_us_ * static_cast<double>(ticks_));
  state.nonce = ticks_;
  const int size = state.encode(buffer_.data(), 0, static_cast<int>(buffer_.size()));
  ssize_t got = -1;
  if (::send(socket_, buffer_.data(), static_cast<std::size_t>(size), MSG_NOSIGNAL) == size)
    got = ::recv(socket_, buffer_.data(), buffer_.size(), 0);
  if (got <= 0 || !decode(std::span(buffer_).first(static_cast<std::size_t>(got)), received_))
    throw std::runtime_error("the law gave no answer: it has ended");
  answer.answer = received_.answer == softarm_messages::law_command_t::PRESSURES
                      ? LawAnswer::pressures
                      : LawAnswer::force;
  answer.validity_ns = 1000 * std::int64_t{received_.validity_us};
  answer.values = Eigen::Map<const Eigen::VectorXd>(received_.value.data(), received_.num_values);
  return true;
}

}  // namespace softarm
