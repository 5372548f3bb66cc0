// Our client and our server over TCP on the loopback interface, and the server against bytes that
// no client of a good will sends.
#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <numeric>
#include <thread>

#include "softarm/base/clock.hpp"
#include "softarm/valves/modbus_server.hpp"
#include "softarm/valves/modbus_terminal.hpp"

namespace softarm {
namespace {

/// Registers 0 to 399, all of them for everyone.
class Shelf : public RegisterBank {
 public:
  std::span<std::uint16_t, 65536> registers() noexcept override {
    return std::span<std::uint16_t, 65536>(words);
  }
  bool readable(int address, int count) const noexcept override { return address + count <= 400; }
  bool writable(int address, int count) const noexcept override { return address + count <= 400; }
  void served(int, int) noexcept override { ++requests; }

  std::vector<std::uint16_t> words = std::vector<std::uint16_t>(65536, 0);
  std::atomic<int> requests{0};
};

class Modbus : public ::testing::Test {
 protected:
  Modbus() {
    settings.port = server.port();
    settings.response_timeout_s = 5.0;  // patience, not a bound
  }
  void start() {
    thread = std::jthread([this](const std::stop_token& stop) {
      while (!stop.stop_requested())
        if (server.wait_until(monotonic_now_ns() + 5'000'000)) server.serve(shelf);
    });
  }
  int raw_client() const {
    const int socket = ::socket(AF_INET, SOCK_STREAM, 0);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<std::uint16_t>(server.port()));
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(connect(socket, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
    const timeval patience{.tv_sec = 10, .tv_usec = 0};
    setsockopt(socket, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
    return socket;
  }
  /// The answer to these bytes; empty: the server hung up.
  static std::vector<std::uint8_t> ask(int socket, const std::vector<std::uint8_t>& bytes) {
    EXPECT_EQ(send(socket, bytes.data(), bytes.size(), MSG_NOSIGNAL),
              static_cast<ssize_t>(bytes.size()));
    std::vector<std::uint8_t> answer(300);
    const ssize_t size = recv(socket, answer.data(), answer.size(), 0);
    answer.resize(size > 0 ? static_cast<std::size_t>(size) : 0);
    return answer;
  }

  /// The server counts a request after it has answered it.
  int requests_from(int expected) const {
    const std::int64_t end_ns = monotonic_now_ns() + 10'000'000'000;
    while (shelf.requests < expected && monotonic_now_ns() < end_ns) std::this_thread::yield();
    return shelf.requests;
  }

  ModbusServer server{0};
  Shelf shelf;
  ValveDriverSettings settings;
  std::jthread thread;
};

TEST_F(Modbus, BlocksGoThereAndBackAlsoWhereTheyExceedOneRequest) {
  start();
  ModbusTerminal terminal(settings);
  ASSERT_TRUE(terminal.connect()) << terminal.error();
  std::vector<std::uint16_t> words(390), found(390);
  std::iota(words.begin(), words.end(), 7);
  ASSERT_EQ(terminal.write(5, words), LinkResult::ok) << terminal.error();
  EXPECT_EQ(requests_from(4), 4) << "123 words a request";
  ASSERT_EQ(terminal.read(5, found), LinkResult::ok) << terminal.error();
  EXPECT_EQ(found, words);
  EXPECT_EQ(requests_from(8), 8) << "125 words a request";
  EXPECT_EQ(shelf.words[5], 7);
  EXPECT_EQ(shelf.words[394], 396);
}

TEST_F(Modbus, WhatIsNotOfferedIsAnExceptionAndTheLinkLives) {
  start();
  ModbusTerminal terminal(settings);
  ASSERT_TRUE(terminal.connect());
  std::vector<std::uint16_t> words(3);
  EXPECT_EQ(terminal.write(398, words), LinkResult::exception_reply);
  EXPECT_STREQ(terminal.error(), "Illegal data address");
  EXPECT_EQ(terminal.read(60000, words), LinkResult::exception_reply);
  EXPECT_EQ(terminal.read(0, words), LinkResult::ok);
}

TEST_F(Modbus, ASilentServerIsNoAnswerAndALateOneIsNotTakenForTheNext) {
  settings.response_timeout_s = 0.05;
  ModbusTerminal terminal(settings);
  ASSERT_TRUE(terminal.connect()) << "the kernel accepts";
  std::vector<std::uint16_t> ones(1, 1), found(1);
  shelf.words[9] = 77;
  EXPECT_EQ(terminal.write(8, ones), LinkResult::no_answer);
  start();  // now it answers what was asked before
  while (shelf.requests == 0) std::this_thread::yield();
  LinkResult result = LinkResult::no_answer;
  for (int k = 0; k < 200 && result == LinkResult::no_answer; ++k) result = terminal.read(9, found);
  EXPECT_EQ(result, LinkResult::ok);
  EXPECT_EQ(found[0], 77);
}

TEST_F(Modbus, AServerThatIsGoneIsABrokenLink) {
  auto gone = std::make_unique<ModbusServer>(0);
  settings.port = gone->port();
  ModbusTerminal terminal(settings);
  ASSERT_TRUE(terminal.connect());
  while (!gone->wait_until(monotonic_now_ns() + 1'000'000'000)) {
  }
  gone->serve(shelf);
  gone.reset();
  std::vector<std::uint16_t> words(1);
  EXPECT_EQ(terminal.read(0, words), LinkResult::broken);
  EXPECT_FALSE(terminal.connect());
  EXPECT_EQ(terminal.read(0, words), LinkResult::broken);
}

TEST_F(Modbus, OnlyAddressesAreHosts) {
  settings.host = "terminal.example";
  EXPECT_THROW(ModbusTerminal{settings}, std::invalid_argument);
  EXPECT_THROW(ModbusServer{server.port()}, std::runtime_error) << "the port is taken";
}

TEST_F(Modbus, HostileRequestsChangeNothing) {
  start();
  using Bytes = std::vector<std::uint8_t>;
  // Transaction 1, protocol 0, length, unit, function ...
  const Bytes refused[] = {
      {0, 1, 0, 0, 0, 6, 1, 3, 0, 0, 0, 0},                     // reads nothing
      {0, 1, 0, 0, 0, 6, 1, 3, 0, 0, 0xff, 0xff},               // reads 65535 words
      {0, 1, 0, 0, 0, 6, 1, 3, 0xff, 0xff, 0, 125},             // beyond the last
      {0, 1, 0, 0, 0, 9, 1, 16, 0, 0, 0, 1, 2, 0xde, 0xad},     // (valid: see below)
      {0, 1, 0, 0, 0, 9, 1, 16, 0, 0, 0, 2, 2, 0xde, 0xad},     // two words, one there
      {0, 1, 0, 0, 0, 9, 1, 16, 0, 0, 0x7f, 1, 2, 0xde, 0xad},  // many words, one there
      {0, 1, 0, 0, 0, 6, 1, 1, 0, 0, 0, 1},                     // coils
      {0, 1, 0, 0, 0, 2, 1, 0x2b},                              // another function
  };
  for (const Bytes& bytes : refused) {
    const int client = raw_client();
    const Bytes answer = ask(client, bytes);
    if (&bytes == &refused[3]) {
      ASSERT_GE(answer.size(), 8u);
      EXPECT_EQ(answer[7], 16);
      EXPECT_EQ(shelf.words[0], 0xdead);
      shelf.words[0] = 0;
      EXPECT_EQ(requests_from(1), 1);
    } else if (!answer.empty()) {
      EXPECT_EQ(answer[7] & 0x80, 0x80);
    }
    close(client);
  }
  EXPECT_EQ(shelf.requests, 1);
  EXPECT_EQ(shelf.words, std::vector<std::uint16_t>(65536, 0));
}

TEST_F(Modbus, HalfARequestAndNoiseAreHungUpOn) {
  start();
  const int half = raw_client();
  EXPECT_TRUE(ask(half, {0, 1, 0, 0, 0, 6, 1}).empty());
  close(half);
  const int noise = raw_client();
  std::uint32_t state = 7;
  std::vector<std::uint8_t> bytes(250);
  for (int round = 0; round < 50; ++round) {
    for (auto& byte : bytes)
      byte = static_cast<std::uint8_t>((state = state * 1664525U + 1013904223U) >> 24);
    const int client = raw_client();
    send(client, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    close(client);
  }
  close(noise);
  ModbusTerminal terminal(settings);
  std::vector<std::uint16_t> words(1);
  LinkResult result = LinkResult::broken;  // until the last of them is dropped
  for (int k = 0; k < 1000 && result != LinkResult::ok; ++k)
    if (terminal.connect()) result = terminal.read(0, words);
  EXPECT_EQ(result, LinkResult::ok) << terminal.error();
}

TEST_F(Modbus, OneClientTooManyIsTurnedAway) {
  start();
  std::vector<std::unique_ptr<ModbusTerminal>> terminals;
  std::vector<std::uint16_t> words(1);
  for (int k = 0; k < ModbusServer::kMaxClients; ++k) {
    terminals.push_back(std::make_unique<ModbusTerminal>(settings));
    ASSERT_TRUE(terminals.back()->connect());
    ASSERT_EQ(terminals.back()->read(0, words), LinkResult::ok);
  }
  ModbusTerminal another(settings);
  if (another.connect()) {
    EXPECT_EQ(another.read(0, words), LinkResult::broken);
  }
  for (const auto& terminal : terminals) EXPECT_EQ(terminal->read(0, words), LinkResult::ok);
}

}  // namespace
}  // namespace softarm
