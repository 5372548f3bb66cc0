#include "softarm/transport/event_log.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <stdexcept>
#include <utility>

namespace softarm {
namespace {

// sync word (4), number (8), time (8), length of the channel (4), of the data (4); big-endian
constexpr std::size_t kHeader = 28;
constexpr std::array<std::byte, 4> kSync = {std::byte{0xED}, std::byte{0xA1}, std::byte{0xDA},
                                            std::byte{0x01}};
constexpr std::size_t kBlock = 64 * 1024;

std::uint64_t number_at(const std::byte* bytes, std::size_t size) {
  std::uint64_t value = 0;
  for (std::size_t k = 0; k < size; ++k) value = value << 8 | std::to_integer<unsigned>(bytes[k]);
  return value;
}

void put_number(std::uint64_t value, std::size_t size, std::byte*& to) {
  for (std::size_t k = size; k-- > 0;) *to++ = static_cast<std::byte>(value >> (8 * k) & 0xff);
}

}  // namespace

EventLogReader::EventLogReader(const std::filesystem::path& path)
    : file_(path, std::ios::binary), stream_(file_) {
  if (!file_ || std::filesystem::is_directory(path))
    throw std::runtime_error("cannot read " + path.string() +
                             ": is it an LCM log (softarm import, lcm-logger)?");
}

/// Reads until `wanted` bytes follow the cursor, or the log ends; returns how many follow it.
std::size_t EventLogReader::available(std::size_t wanted) {
  while (buffer_.size() - at_ < wanted && stream_.good()) {
    buffer_.erase(buffer_.begin(), buffer_.begin() + static_cast<std::ptrdiff_t>(at_));
    base_ += static_cast<std::int64_t>(at_);
    at_ = 0;
    const std::size_t before = buffer_.size();
    buffer_.resize(before + kBlock);
    stream_.read(reinterpret_cast<char*>(buffer_.data() + before), kBlock);
    buffer_.resize(before + static_cast<std::size_t>(stream_.gcount()));
  }
  return buffer_.size() - at_;
}

bool EventLogReader::sync_at(std::size_t offset) const {
  return std::equal(kSync.begin(), kSync.end(), buffer_.data() + at_ + offset);
}

/// Whether another sync word begins within the `size` bytes after the cursor (all in the buffer),
/// even if it ends beyond them. Every byte is searched only once, however often this is called.
bool EventLogReader::meets_sync(std::size_t size) {
  const auto offset_of = [this](std::int64_t log_position) {
    return static_cast<std::size_t>(log_position - base_);
  };
  searched_ = std::max(searched_, position() + 1);
  const auto end = buffer_.begin() + static_cast<std::ptrdiff_t>(
                                         std::min(at_ + size + kSync.size() - 1, buffer_.size()));
  const auto begin = buffer_.begin() + static_cast<std::ptrdiff_t>(offset_of(searched_));
  if (begin >= end) return false;
  const auto found = std::search(begin, end, kSync.begin(), kSync.end());
  searched_ = base_ + (found - buffer_.begin());
  if (found == end) searched_ -= static_cast<std::int64_t>(kSync.size()) - 1;
  return found != end;
}

/// Size of the event at the cursor, or 0 if there is no acceptable one.
std::size_t EventLogReader::plausible_size() {
  if (available(kHeader) < kHeader || !sync_at(0)) return 0;
  const std::byte* header = buffer_.data() + at_;
  const std::uint64_t channel = number_at(header + 20, 4);
  const std::uint64_t data = number_at(header + 24, 4);
  if (channel < 1 || channel > kLargestChannel || data > kLargestData) return 0;
  const std::size_t size = kHeader + static_cast<std::size_t>(channel + data);
  const std::size_t there = available(size + kSync.size());
  if (there < size) return 0;  // cut off
  const auto* name = reinterpret_cast<const char*>(buffer_.data() + at_ + kHeader);
  if (std::any_of(name, name + channel, [](char c) { return c > -1 && c < 0x20; })) return 0;
  if (there == size || (there >= size + kSync.size() && sync_at(size))) return size;
  return meets_sync(size) ? 0 : size;
}

/// Leaves the cursor at the next sync word, or at the end of the log.
void EventLogReader::skip_to_sync() {
  ++at_;
  while (available(kSync.size()) >= kSync.size()) {
    const auto begin = buffer_.begin() + static_cast<std::ptrdiff_t>(at_);
    const auto found = std::search(begin, buffer_.end(), kSync.begin(), kSync.end());
    if (found != buffer_.end()) {
      at_ = static_cast<std::size_t>(found - buffer_.begin());
      return;
    }
    at_ = buffer_.size() - (kSync.size() - 1);
  }
  at_ = buffer_.size();
}

void EventLogReader::add_damage(std::int64_t begin, std::int64_t end) {
  damaged_bytes_ += end - begin;
  ++damage_count_;
  if (damages_.size() < kDamagesKept) damages_.push_back({begin, end});
}

std::string EventLogReader::damage_text() const {
  if (damages_.empty()) return "";
  const LogDamage& first = damages_.front();
  return fmt::format(
      "bytes {} to {} are damaged or cut, {} stretches and {} bytes in all; what precedes and "
      "follows them was used",
      first.begin, first.end, damage_count_, damaged_bytes_);
}

bool EventLogReader::next(LogEvent& event) {
  at_ += std::exchange(event_, 0);
  const std::int64_t begin = position();
  std::size_t size = 0;
  while (available(1) > 0 && (size = plausible_size()) == 0) skip_to_sync();
  if (position() > begin) add_damage(begin, position());
  if (size == 0) return false;
  const std::byte* header = buffer_.data() + at_;
  const auto channel = static_cast<std::size_t>(number_at(header + 20, 4));
  event.position = position();
  event.number = static_cast<std::int64_t>(number_at(header + 4, 8));
  event.time_us = static_cast<std::int64_t>(number_at(header + 12, 8));
  event.channel = {reinterpret_cast<const char*>(header + kHeader), channel};
  event.data = {header + kHeader + channel, size - kHeader - channel};
  event_ = size;
  return true;
}

void EventLogWriter::write(std::int64_t time_us, std::string_view channel,
                           std::span<const std::byte> data) {
  if (channel.empty() || channel.size() > EventLogReader::kLargestChannel ||
      data.size() > EventLogReader::kLargestData)
    throw std::invalid_argument(
        fmt::format("an event of a log: expected a channel of 1 to {} bytes and data of up to {}, "
                    "got {} and {}",
                    EventLogReader::kLargestChannel, EventLogReader::kLargestData, channel.size(),
                    data.size()));
  std::array<std::byte, kHeader> header;
  std::byte* to = std::copy(kSync.begin(), kSync.end(), header.data());
  put_number(static_cast<std::uint64_t>(number_++), 8, to);
  put_number(static_cast<std::uint64_t>(time_us), 8, to);
  put_number(channel.size(), 4, to);
  put_number(data.size(), 4, to);
  event_.assign(reinterpret_cast<const char*>(header.data()), header.size());
  event_ += channel;
  event_.append(reinterpret_cast<const char*>(data.data()), data.size());
  file_.write(event_);
}

}  // namespace softarm
