// Runs `softarm import` as a user would and reads its log back.
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <lcm/lcm-cpp.hpp>
#include <softarm_messages/mocap_frame_t.hpp>
#include <softarm_messages/pressure_command_t.hpp>
#include <softarm_messages/pressure_measurement_t.hpp>
#include <string>
#include <vector>

#include "program_output.hpp"
#include "test_folder.hpp"

namespace softarm::test {

/// One event of a channel.
template <class Message>
struct Event {
  std::int64_t time_us;
  Message message;
};

template <class Message>
std::vector<Event<Message>> read_log(const std::string& file, const std::string& channel) {
  std::vector<Event<Message>> events;
  lcm::LogFile log(file, "r");
  if (!log.good()) return events;
  while (const lcm::LogEvent* event = log.readNextEvent()) {
    if (event->channel != channel) continue;
    Message message;
    if (message.decode(event->data, 0, event->datalen) != event->datalen) {
      ADD_FAILURE() << "an event of " << channel << " does not decode";
    }
    events.push_back({event->timestamp, message});
  }
  return events;
}

/// A separate folder, removed afterwards.
class ImportTest : public testing::Test {
 protected:
  std::string path(const std::string& name) const { return (folder / name).string(); }
  std::string write(const std::string& name, const std::string& text) const {
    return folder.write(name, text).string();
  }
  Outcome import(const std::string& csv, const std::string& map) const {
    return run("import '" + csv + "' '" + map + "' --out '" + path("log") + "'");
  }

  TestFolder folder;
};

}  // namespace softarm::test
