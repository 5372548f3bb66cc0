#include "softarm/valves/modbus_server.hpp"

#include <arpa/inet.h>
#include <fcntl.h>
#include <modbus/modbus.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <new>
#include <stdexcept>
#include <string>

#include "softarm/base/clock.hpp"

namespace softarm {
namespace {

/// A request must be complete within this time after its first byte.
constexpr std::uint32_t kRequest_us = 20'000;
/// A client has to be accepted before it can be refused.
constexpr int kBacklog = 64;
constexpr int kHeader = 7;  // of Modbus TCP, before the function code

struct Request {
  int function = 0, address = 0, count = 0;
  bool writes = false;
  int exception = 0;
};

int word_at(const std::uint8_t* bytes) { return bytes[0] << 8 | bytes[1]; }

/// libmodbus does not check everything that an unknown client may send.
Request parse(const std::uint8_t* query, int size, const RegisterBank& bank) {
  Request request{.function = query[kHeader]};
  if (request.function != MODBUS_FC_READ_HOLDING_REGISTERS &&
      request.function != MODBUS_FC_WRITE_SINGLE_REGISTER &&
      request.function != MODBUS_FC_WRITE_MULTIPLE_REGISTERS) {
    request.exception = MODBUS_EXCEPTION_ILLEGAL_FUNCTION;
    return request;
  }
  request.address = word_at(query + kHeader + 1);
  request.writes = request.function != MODBUS_FC_READ_HOLDING_REGISTERS;
  const bool several = request.function == MODBUS_FC_WRITE_MULTIPLE_REGISTERS;
  request.count =
      request.function == MODBUS_FC_WRITE_SINGLE_REGISTER ? 1 : word_at(query + kHeader + 3);
  const int most = request.writes ? MODBUS_MAX_WRITE_REGISTERS : MODBUS_MAX_READ_REGISTERS;
  if (request.count < 1 || request.count > most ||
      (several &&
       (query[kHeader + 5] != 2 * request.count || size != kHeader + 6 + 2 * request.count))) {
    request.exception = MODBUS_EXCEPTION_ILLEGAL_DATA_VALUE;
  } else if (!(request.writes ? bank.writable(request.address, request.count)
                              : bank.readable(request.address, request.count))) {
    request.exception = MODBUS_EXCEPTION_ILLEGAL_DATA_ADDRESS;
  }
  return request;
}

}  // namespace

ModbusServer::ModbusServer(int port) : context_(modbus_new_tcp("127.0.0.1", port)) {
  if (context_ == nullptr) throw std::bad_alloc();
  modbus_set_indication_timeout(context_, 0, kRequest_us);
  modbus_set_byte_timeout(context_, 0, kRequest_us);
  listener_ = modbus_tcp_listen(context_, kBacklog);
  sockaddr_in address{};
  socklen_t size = sizeof address;
  if (listener_ < 0 || getsockname(listener_, reinterpret_cast<sockaddr*>(&address), &size) != 0) {
    const int error = errno;
    modbus_free(context_);
    throw std::runtime_error("cannot listen on 127.0.0.1 port " + std::to_string(port) + ": " +
                             std::strerror(error) +
                             "; choose a port that is free and not below 1024");
  }
  port_ = ntohs(address.sin_port);
  fcntl(listener_, F_SETFL, O_NONBLOCK);  // a client may be gone before it is accepted
  clients_.reserve(kMaxClients);
  readable_.reserve(kMaxClients + 1);
}

ModbusServer::~ModbusServer() {
  for (const int client : clients_) ::close(client);
  ::close(listener_);
  modbus_free(context_);
}

int ModbusServer::poll_until(std::int64_t deadline_ns) noexcept {
  const timespec timeout = time_left(deadline_ns);
  std::array<pollfd, kMaxClients + 1> descriptors{};
  descriptors[0] = {.fd = listener_, .events = POLLIN, .revents = 0};
  for (std::size_t k = 0; k < clients_.size(); ++k)
    descriptors[k + 1] = {.fd = clients_[k], .events = POLLIN, .revents = 0};
  readable_.clear();
  const int ready = ppoll(descriptors.data(), clients_.size() + 1, &timeout, nullptr);
  for (std::size_t k = 0; k <= clients_.size() && ready > 0; ++k)
    if (descriptors[k].revents != 0) readable_.push_back(descriptors[k].fd);
  return ready;
}

bool ModbusServer::wait_until(std::int64_t deadline_ns) noexcept {
  return poll_until(deadline_ns) > 0;
}

void ModbusServer::accept_client() noexcept {
  const int socket = accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC);
  if (socket < 0) return;
  if (static_cast<int>(clients_.size()) == kMaxClients) {
    ::close(socket);
    return;
  }
  const int yes = 1;
  setsockopt(socket, IPPROTO_TCP, TCP_NODELAY, &yes, sizeof yes);
  clients_.push_back(socket);
}

bool ModbusServer::serve_client(int socket, RegisterBank& bank) noexcept {
  std::uint8_t query[MODBUS_TCP_MAX_ADU_LENGTH];
  modbus_set_socket(context_, socket);
  const int size = modbus_receive(context_, query);
  if (size < kHeader + 1) return false;
  const Request request = parse(query, size, bank);
  if (request.exception != 0)
    return modbus_reply_exception(context_, query, static_cast<unsigned int>(request.exception)) >
           0;
  const std::span<std::uint16_t, 65536> registers = bank.registers();
  modbus_mapping_t mapping{};
  mapping.nb_registers = static_cast<int>(registers.size());
  mapping.tab_registers = registers.data();
  const bool answered = modbus_reply(context_, query, size, &mapping) > 0;
  bank.served(request.address, request.writes ? request.count : 0);
  return answered;
}

void ModbusServer::serve(RegisterBank& bank) noexcept {
  poll_until(0);
  for (const int socket : readable_) {
    if (socket == listener_) {
      accept_client();
    } else if (!serve_client(socket, bank)) {
      ::close(socket);
      std::erase(clients_, socket);
    }
  }
}

}  // namespace softarm
