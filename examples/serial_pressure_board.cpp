// An own valve back end: a pressure board on a serial line with a protocol of text lines.
//   "W 200" -> "W 200"                 vents after 200 ms of silence; answers what it took
//   "S 0.000 0.350" -> "P 0.002 0.347" set points -> measured pressures, bar, one per chamber
// CONFIG: `valves: {backend: serial_board, device: /dev/ttyUSB0}`, and a rate that the line allows
#include <charconv>
#include <cmath>

#include "softarm/apps/valve_driver.hpp"
#include "softarm/valves/serial_line.hpp"

using softarm::LinkResult;

class SerialBoard : public softarm::ValveBackend {
 public:
  explicit SerialBoard(const softarm::ValveDriverSettings& settings)
      : line_(settings.device, 115200, settings.response_timeout_s),
        vent_after_("W " + std::to_string(std::lround(1e3 * settings.failsafe_timeout_s))),
        text_(16 + 16 * settings.order.size()) {}
  bool connect() noexcept override { return line_.open(); }
  void close() noexcept override { line_.close(); }
  bool is_open() const noexcept override { return line_.is_open(); }
  const char* error() const noexcept override { return line_.error(); }
  std::string address() const override { return line_.device(); }
  bool answers_writes() const noexcept override { return true; }

  Secured secure() noexcept override {
    LinkResult result = line_.send(vent_after_);
    if (result == LinkResult::ok) result = line_.receive(answer_);
    return {result, result == LinkResult::ok && answer_ == vent_after_};
  }
  LinkResult write(const Eigen::VectorXd& set_points_bar) noexcept override {
    char* at = text_.data();
    *at++ = 'S';
    for (const double bar : set_points_bar) {
      *at++ = ' ';
      at = std::to_chars(at, &text_.back(), bar, std::chars_format::fixed, 3).ptr;
    }
    return line_.send({text_.data(), at});
  }
  LinkResult read(softarm::ReadBack& read_back) noexcept override {
    if (const LinkResult result = line_.receive(answer_); result != LinkResult::ok) return result;
    if (!answer_.starts_with('P')) return LinkResult::no_answer;
    const char *at = answer_.begin() + 1, *end = answer_.end();
    for (double& bar : read_back.actual_bar) {
      if (at == end || *at != ' ') return LinkResult::no_answer;
      at = std::from_chars(at + 1, end, bar = NAN).ptr;
    }
    return at == end ? LinkResult::ok : LinkResult::no_answer;
  }

 private:
  softarm::SerialLine line_;
  std::string vent_after_;
  std::vector<char> text_;
  std::string_view answer_;
};

const softarm::ValveBackendRegistration<SerialBoard> kRegistration("serial_board");

int main(int argc, char** argv) { return softarm::run_valve_driver(argc, argv); }
