// What motion-capture servers send, OptiTrack's and Qualisys': in every version the decoders stay
// within their bounds, and what they accept they send again.
#include <algorithm>
#include <cmath>

#include "fuzz/same_body.hpp"
#include "fuzz/target.hpp"
#include "transport/natnet_packets.hpp"
#include "transport/qtm_packets.hpp"

namespace softarm::test {
namespace {

const NatnetVersion kVersions[] = {{3, 0}, {4, 0}, {4, 1}, {4, 2}};
constexpr std::size_t kMessages = 3;

BodyNames names() {
  BodySettings bodies{.base_id = 0, .segment_ids = {1, 2}};
  bodies.base_marker_frame.name = "base";
  bodies.segment_marker_frames = {{.name = "a & b"}, {.name = "tip"}};
  return BodyNames(bodies);
}

SentFrame two_bodies() {
  SentFrame frame;
  frame.frame_number = 7;
  frame.sender_time_us = 1'000'000;
  frame.bodies = 2;
  for (std::size_t k = 0; k < 2; ++k)
    frame.body[k] = {static_cast<std::int32_t>(k + 1), k == 0, {1, 2, 3}, {1, 0, 0, 0}};
  return frame;
}

/// The same, where the orientation went through a matrix of floats.
bool nearly_same(const SentBody& a, const SentBody& b) {
  double sum = 0.0, difference = 0.0;
  for (std::size_t k = 0; k < 4; ++k) {
    sum = std::max(sum, std::abs(a.orientation[k] + b.orientation[k]));
    difference = std::max(difference, std::abs(a.orientation[k] - b.orientation[k]));
  }
  return a.id == b.id && a.seen == b.seen && a.position == b.position &&
         std::min(sum, difference) < 1e-5;
}

}  // namespace

/// The first byte chooses version and packet.
void run_natnet(std::span<const std::byte> input) {
  if (input.empty()) return;
  const auto choice = std::to_integer<std::size_t>(input.front());
  NatnetDialect dialect{.version = kVersions[choice / kMessages % std::size(kVersions)]};
  const auto contents = input.subspan(1);
  if (choice % kMessages == 0) {
    decode_natnet_server(contents, dialect);
    return;
  }
  if (choice % kMessages == 1) {
    BodyNames all = names();
    decode_natnet_models(contents, dialect.version, all);
    return;
  }
  static SentFrame frame, again;
  NatnetNews news;
  if (!decode_natnet_frame(contents, dialect, frame, news)) return;
  require(frame.bodies <= SentFrame::kMostBodies, "bodies stay within their capacity");
  Bytes packet;
  encode_natnet_frame(frame, dialect, packet);
  const auto sent = natnet_contents(packet, NatnetMessage::frame);
  require(decode_natnet_frame(sent, dialect, again, news), "what was accepted can be sent");
  require(std::equal(frame.body.begin(), frame.body.begin() + frame.bodies, again.body.begin(),
                     again.body.begin() + again.bodies, same_body),
          "what is sent again is the same");
  names().translate(frame);
}

std::vector<Bytes> natnet_seeds() {
  std::vector<Bytes> seeds;
  for (std::size_t v = 0; v < std::size(kVersions); ++v) {
    const NatnetDialect dialect{.version = kVersions[v]};
    std::vector<Bytes> packets(kMessages);
    encode_natnet_server(dialect, packets[0]);
    encode_natnet_models(dialect.version, names(), packets[1]);
    encode_natnet_frame(two_bodies(), dialect, packets[2]);
    for (std::size_t k = 0; k < kMessages; ++k) {
      Bytes seed = {static_cast<std::byte>(v * kMessages + k)};
      seed.insert(seed.end(), packets[k].begin() + 4, packets[k].end());
      seeds.push_back(seed);
    }
  }
  return seeds;
}

/// The first byte chooses: the answer about names, or a frame.
void run_qtm(std::span<const std::byte> input) {
  if (input.empty()) return;
  const auto bytes = input.subspan(1);
  if (qtm_header(bytes)) require(qtm_header(bytes)->size >= kQtmHeader, "a packet has a header");
  if ((input.front() & std::byte{1}) == std::byte{0}) {
    BodyNames all = names();
    read_qtm_names(qtm_text(bytes), all);
    return;
  }
  static SentFrame frame, again;
  if (!decode_qtm_frame(bytes, frame)) return;
  require(frame.bodies <= SentFrame::kMostBodies, "bodies stay within their capacity");
  Bytes packet;
  encode_qtm_frame(frame, packet);
  require(decode_qtm_frame(std::span(packet).subspan(kQtmHeader), again),
          "what was accepted can be sent");
  require(std::equal(frame.body.begin(), frame.body.begin() + frame.bodies, again.body.begin(),
                     again.body.begin() + again.bodies, nearly_same),
          "what is sent again is the same");
}

std::vector<Bytes> qtm_seeds() {
  std::vector<Bytes> seeds(2);
  Bytes packet;
  encode_qtm_names(names(), packet);
  seeds[0] = {std::byte{0}};
  seeds[0].insert(seeds[0].end(), packet.begin() + kQtmHeader, packet.end());
  encode_qtm_frame(two_bodies(), packet);
  seeds[1] = {std::byte{1}};
  seeds[1].insert(seeds[1].end(), packet.begin() + kQtmHeader, packet.end());
  return seeds;
}

std::vector<std::string> qtm_words() {
  return {"<Body>", "</Body>", "<Name>", "</Name>", "&amp;", "tip", std::string(4, '\xff')};
}

}  // namespace softarm::test
