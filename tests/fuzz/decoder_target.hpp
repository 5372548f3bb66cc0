// The target of one decoder: what it accepts must be exactly what the sender's encoder writes.
#pragma once

#include "fuzz/target.hpp"
#include "unit/transport/messages.hpp"

namespace softarm::test {

template <class Message>
void run_decoder(std::span<const std::byte> input) {
  static Message message{};  // reused, as the programs do
  if (!decode(input, message)) return;
  static Bytes again;
  again.resize(static_cast<std::size_t>(message.getEncodedSize()));
  require(again.size() == input.size(), "what was accepted encodes to as many bytes");
  require(message.encode(again.data(), 0, static_cast<int>(again.size())) ==
              static_cast<int>(again.size()),
          "what was accepted can be encoded");
  require(std::equal(again.begin(), again.end(), input.begin()),
          "what was accepted encodes to the same bytes");
}

template <class Message>
std::vector<Bytes> decoder_seeds() {
  return {encoded(example<Message>(0, 0)), encoded(example<Message>(1, 3)),
          encoded(example<Message>(3, 4))};
}

/// Counts as they stand in messages: none, one, the largest allowed and those beyond, negative.
inline std::vector<std::string> decoder_words() {
  return {std::string(2, '\0'),
          std::string("\0\1", 2),
          "\xff\xff",
          std::string("\x80\0", 2),
          "\x7f\xff",
          std::string("\0\x40", 2),
          std::string("\0\x41", 2),
          std::string("\x01\0", 2),
          std::string("\x02\0", 2),
          std::string("\x80\0\0\0", 4),
          "\x7f\xff\xff\xff",
          "\xff\xff\xff\xff",
          std::string("\0\0\1\0", 4),
          std::string("\x7f\xf0\0\0\0\0\0\0", 8)};
}

template <class Message>
FuzzTarget decoder() {
  return {Message::getTypeName(),
          run_decoder<Message>,
          decoder_seeds<Message>,
          decoder_words,
          4096,
          10'000'000};
}

}  // namespace softarm::test
