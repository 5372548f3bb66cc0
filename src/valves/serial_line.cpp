#include "softarm/valves/serial_line.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <stdexcept>
#include <utility>

#include "softarm/base/clock.hpp"
#include "softarm/base/time.hpp"

namespace softarm {
namespace {

speed_t speed_of(int baud) {
  constexpr std::pair<int, speed_t> kSpeeds[] = {
      {9600, B9600},     {19200, B19200},   {38400, B38400},   {57600, B57600},
      {115200, B115200}, {230400, B230400}, {460800, B460800}, {921600, B921600}};
  for (const auto& [rate, speed] : kSpeeds)
    if (rate == baud) return speed;
  throw std::invalid_argument("baud rate: expected a standard one from 9600 to 921600, got " +
                              std::to_string(baud));
}

}  // namespace

SerialLine::SerialLine(std::string device, int baud, double timeout_s)
    : device_(std::move(device)), speed_(speed_of(baud)), timeout_ns_(to_ns(timeout_s)) {}

LinkResult SerialLine::ended(LinkResult result, int error) noexcept {
  error_ = error;
  return result;
}

bool SerialLine::open() noexcept {
  close();
  size_ = taken_ = 0;
  file_ = ::open(device_.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
  termios settings{};
  if (file_ >= 0 && tcgetattr(file_, &settings) == 0) {
    cfmakeraw(&settings);
    cfsetspeed(&settings, speed_);
    settings.c_cflag &= ~static_cast<tcflag_t>(CSTOPB | CRTSCTS);
    settings.c_cflag |= CLOCAL | CREAD;
    if (tcsetattr(file_, TCSANOW, &settings) == 0) return true;
  }
  error_ = errno;
  close();
  return false;
}

void SerialLine::close() noexcept {
  if (file_ < 0) return;
  // Closing waits up to half a minute until the device has taken the data sent.
  const std::int64_t deadline_ns = monotonic_now_ns() + timeout_ns_;
  int unsent = 0;
  while (ioctl(file_, TIOCOUTQ, &unsent) == 0 && unsent > 0 && monotonic_now_ns() < deadline_ns)
    sleep_until_ns(std::min(deadline_ns, monotonic_now_ns() + 500'000));
  if (unsent > 0) tcflush(file_, TCOFLUSH);
  ::close(file_);
  file_ = -1;
}

LinkResult SerialLine::send(std::string_view text) noexcept {
  if (file_ < 0) return ended(LinkResult::broken, ENOTCONN);
  if (text.size() >= kLongest) return ended(LinkResult::broken, EMSGSIZE);
  tcflush(file_, TCIFLUSH);
  size_ = taken_ = 0;
  std::array<char, kLongest> line;
  text.copy(line.data(), text.size());
  line[text.size()] = '\n';
  const ssize_t wanted = static_cast<ssize_t>(text.size()) + 1;
  const ssize_t sent = ::write(file_, line.data(), static_cast<std::size_t>(wanted));
  if (sent == wanted) return LinkResult::ok;
  if (sent < 0 && errno == EAGAIN) return ended(LinkResult::no_answer, ETIMEDOUT);
  // A partial line would corrupt the next one.
  return ended(LinkResult::broken, sent < 0 ? errno : EIO);
}

LinkResult SerialLine::receive(std::string_view& text) noexcept {
  if (file_ < 0) return ended(LinkResult::broken, ENOTCONN);
  std::copy(received_.begin() + static_cast<long>(taken_),
            received_.begin() + static_cast<long>(size_), received_.begin());
  size_ -= std::exchange(taken_, 0);
  const std::int64_t deadline_ns = monotonic_now_ns() + timeout_ns_;
  std::size_t searched = 0;
  while (true) {
    const std::string_view all(received_.data(), size_);
    if (const std::size_t end = all.find('\n', searched); end != std::string_view::npos) {
      taken_ = end + 1;
      text = all.substr(0, end);
      if (text.ends_with('\r')) text.remove_suffix(1);
      return ended(LinkResult::ok, EBADMSG);
    }
    searched = size_;
    if (size_ == kLongest) return ended(LinkResult::no_answer, EMSGSIZE);
    const std::int64_t left_ns = deadline_ns - monotonic_now_ns();
    if (left_ns <= 0) return ended(LinkResult::no_answer, ETIMEDOUT);
    const timespec timeout{.tv_sec = left_ns / 1'000'000'000, .tv_nsec = left_ns % 1'000'000'000};
    pollfd descriptor{.fd = file_, .events = POLLIN, .revents = 0};
    if (ppoll(&descriptor, 1, &timeout, nullptr) <= 0) continue;
    const ssize_t count = ::read(file_, received_.data() + size_, kLongest - size_);
    if (count < 0 && (errno == EAGAIN || errno == EINTR)) continue;
    if (count <= 0) return ended(LinkResult::broken, count < 0 ? errno : EIO);
    size_ += static_cast<std::size_t>(count);
  }
}

const char* SerialLine::error() const noexcept { return strerrordesc_np(error_); }

}  // namespace softarm
