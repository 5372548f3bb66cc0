#include "transport/qtm_packets.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <string>
#include <utility>

#include "transport/byte_cursor.hpp"
#include "transport/byte_writer.hpp"

namespace softarm {
namespace {

constexpr std::uint32_t kSixDofWithResidual = 11;
constexpr std::size_t kMatrixBody = (3 + 9 + 1) * 4;
constexpr std::size_t kComponent = 8;  ///< its size and kind
constexpr double kRotation = 1e-3;     ///< a matrix of floats is that close to a rotation

/// w x y z of a matrix sent column by column; zeros where it is no rotation.
std::array<double, 4> quaternion(const Eigen::Matrix3d& matrix) {
  const bool rotation =
      (matrix * matrix.transpose() - Eigen::Matrix3d::Identity()).norm() < kRotation &&
      matrix.determinant() > 0.0;
  if (!rotation) return {};
  const Eigen::Quaterniond q = Eigen::Quaterniond(matrix).normalized();
  return {q.w(), q.x(), q.y(), q.z()};
}

SentBody take_body(LittleEndianCursor& cursor, std::int32_t id) {
  SentBody body{.id = id};
  for (double& each : body.position) each = static_cast<double>(cursor.take<float>());
  Eigen::Matrix3d matrix;
  for (double& each : matrix.reshaped()) each = static_cast<double>(cursor.take<float>());
  cursor.skip(4);  // residual in mm: the distance of the markers from the body, on average
  body.seen = std::isfinite(body.position[0]) && std::isfinite(body.position[1]) &&
              std::isfinite(body.position[2]) && matrix.allFinite();
  if (!body.seen) return {.id = id};
  body.orientation = quaternion(matrix);
  return body;
}

/// The five characters that XML writes as names.
constexpr std::pair<std::string_view, char> kNames[] = {
    {"&amp;", '&'}, {"&lt;", '<'}, {"&gt;", '>'}, {"&quot;", '"'}, {"&apos;", '\''}};

void append_escaped(std::string& out, std::string_view text) {
  for (const char c : text) {
    const auto* const named =
        std::ranges::find(kNames, c, &std::pair<std::string_view, char>::second);
    if (named == std::end(kNames))
      out += c;
    else
      out += named->first;
  }
}

/// Whether `escaped`, as XML writes it, is `name`.
bool is_escaped(std::string_view escaped, std::string_view name) noexcept {
  for (const char c : name) {
    if (escaped.empty()) return false;
    std::size_t length = 1;
    char meant = escaped.front();
    for (const auto& [text, character] : kNames)
      if (escaped.starts_with(text)) {
        length = text.size();
        meant = character;
      }
    if (meant != c) return false;
    escaped.remove_prefix(length);
  }
  return escaped.empty();
}

}  // namespace

std::optional<QtmHeader> qtm_header(std::span<const std::byte> bytes) noexcept {
  LittleEndianCursor cursor(bytes);
  QtmHeader header;
  header.size = cursor.take<std::uint32_t>();
  header.kind = static_cast<QtmMessage>(cursor.take<std::uint32_t>());
  if (!cursor.ok() || header.size < kQtmHeader) return std::nullopt;
  return header;
}

std::string_view qtm_text(std::span<const std::byte> contents) noexcept {
  const std::string_view text{reinterpret_cast<const char*>(contents.data()), contents.size()};
  return text.substr(0, text.find('\0'));
}

bool decode_qtm_frame(std::span<const std::byte> contents, SentFrame& frame) noexcept {
  LittleEndianCursor cursor(contents);
  frame.sender_time_us = cursor.take<std::int64_t>();
  frame.frame_number = cursor.take<std::uint32_t>();
  frame.bodies = 0;
  const std::size_t components = cursor.count(kComponent);
  bool found = false;
  for (std::size_t k = 0; k < components && cursor.ok(); ++k) {
    const std::size_t size = cursor.take<std::uint32_t>();
    const auto kind = cursor.take<std::uint32_t>();
    LittleEndianCursor component(
        cursor.take_bytes(size < kComponent ? contents.size() : size - kComponent));
    if (!cursor.ok() || kind != kSixDofWithResidual) continue;
    const std::size_t bodies = component.left() < 8 ? 0 : component.count(kMatrixBody);
    component.skip(2 + 2);  // rates of dropped and late frames
    if (found || !component.ok() || component.left() != bodies * kMatrixBody) return false;
    if (bodies > SentFrame::kMostBodies) return false;
    found = true;
    frame.bodies = bodies;
    for (std::size_t i = 0; i < bodies; ++i)
      frame.body[i] = take_body(component, static_cast<std::int32_t>(i + 1));
  }
  return found && cursor.at_end();
}

void read_qtm_names(std::string_view xml, BodyNames& names) noexcept {
  constexpr std::string_view kBegin = "<Name>", kEnd = "</Name>", kBodyBegin = "<Body",
                             kBodyEnd = "</Body>";
  std::int32_t place = 0;
  while (true) {
    const std::size_t at = xml.find(kBodyBegin);
    if (at == std::string_view::npos) return;
    xml.remove_prefix(at + kBodyBegin.size());
    if (!xml.starts_with('>') && !xml.starts_with(' ')) continue;  // another element: <BodyXxx>
    ++place;
    const std::string_view body = xml.substr(0, xml.find(kBodyEnd));
    const std::size_t begin = body.find(kBegin);
    if (begin != std::string_view::npos) {
      const std::string_view rest = body.substr(begin + kBegin.size());
      const std::string_view name = rest.substr(0, rest.find(kEnd));
      for (const NamedBody& each : names.bodies())
        if (!each.name.empty() && is_escaped(name, each.name)) names.note(each.name, place);
    }
    xml.remove_prefix(body.size());
  }
}

namespace {

/// A packet: its size follows when it is complete.
class QtmPacket {
 public:
  QtmPacket(QtmMessage kind, std::vector<std::byte>& out) : out_(out), writer_(out) {
    out.clear();
    writer_.put(std::uint32_t{0});
    writer_.put(static_cast<std::uint32_t>(kind));
  }
  ~QtmPacket() { writer_.put_at(0, static_cast<std::uint32_t>(out_.size())); }
  QtmPacket(const QtmPacket&) = delete;
  QtmPacket& operator=(const QtmPacket&) = delete;
  ByteWriter* operator->() { return &writer_; }

 private:
  std::vector<std::byte>& out_;
  ByteWriter writer_;
};

}  // namespace

void encode_qtm_text(QtmMessage kind, std::string_view text, std::vector<std::byte>& out) {
  QtmPacket packet(kind, out);
  packet->put_text(text);
}

void encode_qtm_frame(const SentFrame& frame, std::vector<std::byte>& out) {
  QtmPacket packet(QtmMessage::data, out);
  packet->put(frame.sender_time_us);
  packet->put(static_cast<std::uint32_t>(frame.frame_number));
  packet->put(std::uint32_t{1});  // components
  packet->put(static_cast<std::uint32_t>(kComponent + 8 + kMatrixBody * frame.bodies));
  packet->put(kSixDofWithResidual);
  packet->put(static_cast<std::uint32_t>(frame.bodies));
  packet->put(std::uint32_t{0});  // rates of dropped and late frames
  for (const SentBody& body : std::span(frame.body).first(frame.bodies)) {
    constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
    const auto& q = body.orientation;
    Eigen::Matrix3f matrix = Eigen::Matrix3f::Zero();
    if (q != std::array<double, 4>{})
      matrix = Eigen::Quaterniond(q[0], q[1], q[2], q[3]).toRotationMatrix().cast<float>();
    for (const double each : body.position)
      packet->put(body.seen ? static_cast<float>(each) : kNone);
    for (const float each : matrix.reshaped()) packet->put(body.seen ? each : kNone);
    packet->put(body.seen ? 0.0F : kNone);
  }
}

void encode_qtm_names(const BodyNames& names, std::vector<std::byte>& out) {
  std::string xml = "<QTM_Parameters_Ver_1.25><The_6D><Bodies>" +
                    std::to_string(names.bodies().size()) + "</Bodies>";
  for (const NamedBody& body : names.bodies()) {
    xml += "<Body><Name>";
    append_escaped(xml, body.name);
    xml += "</Name></Body>";
  }
  xml += "</The_6D></QTM_Parameters_Ver_1.25>";
  encode_qtm_text(QtmMessage::xml, xml, out);
}

}  // namespace softarm
