#include "transport/natnet_packets.hpp"

#include <array>
#include <cmath>

#include "softarm/base/time.hpp"
#include "transport/byte_cursor.hpp"
#include "transport/byte_writer.hpp"

namespace softarm {
namespace {

constexpr NatnetVersion kOldest{3, 0}, kMarkerNames{4, 0}, kSizes{4, 1}, kRotations{4, 2};
constexpr std::size_t kApplicationName = 256;
constexpr std::size_t kPoint = 3 * 4, kQuaternion = 4 * 4;
constexpr std::size_t kRigidBody = 4 + kPoint + kQuaternion + 4 + 2;
constexpr std::size_t kLabelledMarker = 4 + kPoint + 4 + 2 + 4;
constexpr std::size_t kLeastSet = 1 + 4, kLeastSkeleton = 4 + 4, kLeastDevice = 4 + 4;
constexpr std::size_t kLongestTail = 64;  ///< what a later version may add to the end of a frame
constexpr std::uint64_t kMostTicks_per_s = 1'000'000'000'000;
constexpr std::uint16_t kTracked = 1, kModelsChanged = 2, kVersionChanged = 4;

enum class Model : std::int32_t {
  marker_set = 0,
  rigid_body = 1,
  skeleton = 2,
  force_plate = 3,
  device = 4,
  camera = 5
};

/// Skips a section; `skip_element` walks over one element of those versions that give no size.
template <class SkipElement>
void skip_section(LittleEndianCursor& cursor, const NatnetVersion& version, std::size_t element,
                  const SkipElement& skip_element) {
  if (version >= kSizes) {
    cursor.skip(4);
    cursor.skip_list(1);
    return;
  }
  const std::size_t elements = cursor.count(element);
  for (std::size_t k = 0; k < elements && cursor.ok(); ++k) skip_element();
}

SentBody take_body(LittleEndianCursor& cursor) {
  SentBody body;
  body.id = cursor.take<std::int32_t>();
  for (double& each : body.position) each = static_cast<double>(cursor.take<float>());
  for (double& each : body.orientation) each = static_cast<double>(cursor.take<float>());
  cursor.skip(4);  // mean error of its markers
  body.seen = (cursor.take<std::uint16_t>() & kTracked) != 0;
  return body;
}

/// The section of rigid bodies. Where its bytes are stated a body may be longer than we know it.
void take_bodies(LittleEndianCursor& cursor, const NatnetVersion& version, SentFrame& frame) {
  frame.bodies = cursor.count(kRigidBody);
  std::size_t each = kRigidBody;
  if (version >= kSizes) {
    const std::size_t bytes = cursor.count(1);
    if (frame.bodies > 0) each = bytes / frame.bodies;
    if (each < kRigidBody || bytes != each * frame.bodies) cursor.fail();
  }
  if (frame.bodies > SentFrame::kMostBodies) cursor.fail();
  for (std::size_t k = 0; k < frame.bodies && cursor.ok(); ++k) {
    LittleEndianCursor body(cursor.take_bytes(each));
    frame.body[k] = take_body(body);
  }
}

/// Force platforms and other devices: channels of samples.
void skip_device(LittleEndianCursor& cursor) {
  cursor.skip(4);
  const std::size_t channels = cursor.count(4);
  for (std::size_t k = 0; k < channels && cursor.ok(); ++k) cursor.skip_list(4);
}

std::int64_t ticks_to_us(std::uint64_t ticks, std::uint64_t ticks_per_s) noexcept {
  const std::uint64_t whole_s = ticks / ticks_per_s, rest = ticks % ticks_per_s;
  if (whole_s > static_cast<std::uint64_t>(kLatest_us / 1'000'000)) return kNoTime_us;
  return static_cast<std::int64_t>(1'000'000 * whole_s + 1'000'000 * rest / ticks_per_s);
}

void skip_texts(LittleEndianCursor& cursor) {
  const std::size_t texts = cursor.count(1);
  for (std::size_t k = 0; k < texts && cursor.ok(); ++k) cursor.take_text();
}

void take_rigid_body_model(LittleEndianCursor& cursor, const NatnetVersion& version,
                           BodyNames* names) {
  const std::string_view name = cursor.take_text();
  const auto id = cursor.take<std::int32_t>();
  cursor.skip(4 + kPoint);  // parent, offset
  if (version >= kRotations) cursor.skip(kQuaternion);
  const std::size_t markers = cursor.count(kPoint + 4);
  cursor.skip(markers * (kPoint + 4));
  if (version >= kMarkerNames)
    for (std::size_t k = 0; k < markers && cursor.ok(); ++k) cursor.take_text();
  if (names != nullptr && cursor.ok()) names->note(name, id);
}

/// False where the kind is not known, so that its end cannot be found.
bool take_model(LittleEndianCursor& cursor, Model kind, const NatnetVersion& version,
                BodyNames& names) {
  switch (kind) {
    case Model::marker_set:
      cursor.take_text();
      skip_texts(cursor);
      return true;
    case Model::rigid_body:
      take_rigid_body_model(cursor, version, &names);
      return true;
    case Model::skeleton: {
      cursor.take_text();
      cursor.skip(4);
      const std::size_t bones = cursor.count(1 + 4 + 4 + kPoint + 4);
      for (std::size_t k = 0; k < bones && cursor.ok(); ++k)
        take_rigid_body_model(cursor, version, nullptr);
      return true;
    }
    case Model::force_plate:
      cursor.skip(4);
      cursor.take_text();
      cursor.skip(4 * (2 + 3 + 12 * 12 + 4 * 3 + 2));  // size, origin, calibration, corners, kinds
      skip_texts(cursor);
      return true;
    case Model::device:
      cursor.skip(4);
      cursor.take_text();
      cursor.take_text();
      cursor.skip(4 + 4);
      skip_texts(cursor);
      return true;
    case Model::camera:
      cursor.take_text();
      cursor.skip(kPoint + kQuaternion);
      return true;
  }
  return false;
}

}  // namespace

std::span<const std::byte> natnet_contents(std::span<const std::byte> packet,
                                           NatnetMessage kind) noexcept {
  LittleEndianCursor cursor(packet);
  const auto message = cursor.take<std::uint16_t>();
  const auto bytes = cursor.take<std::uint16_t>();
  if (!cursor.ok() || message != static_cast<std::uint16_t>(kind) || bytes != cursor.left())
    return {};
  return cursor.take_bytes(bytes);
}

std::vector<std::byte> natnet_request(NatnetMessage kind) {
  std::vector<std::byte> out;
  ByteWriter writer(out);
  writer.put(static_cast<std::uint16_t>(kind));
  writer.put(std::uint16_t{1});
  writer.put_text("");
  return out;
}

bool decode_natnet_server(std::span<const std::byte> contents, NatnetDialect& dialect) noexcept {
  LittleEndianCursor cursor(contents);
  cursor.skip(kApplicationName + 4);  // and its version
  NatnetDialect found;
  found.version.major = cursor.take<std::uint8_t>();
  found.version.minor = cursor.take<std::uint8_t>();
  cursor.skip(2);
  found.ticks_per_s = cursor.take<std::uint64_t>();
  if (!cursor.ok() || found.version < kOldest) return false;
  if (found.ticks_per_s > kMostTicks_per_s) found.ticks_per_s = 0;
  dialect = found;
  return true;
}

bool decode_natnet_models(std::span<const std::byte> contents, const NatnetVersion& version,
                          BodyNames& names) noexcept {
  LittleEndianCursor cursor(contents);
  const std::size_t models = cursor.count(4 + 1);
  for (std::size_t k = 0; k < models && cursor.ok(); ++k) {
    const auto kind = static_cast<Model>(cursor.take<std::int32_t>());
    if (version >= kSizes) {
      LittleEndianCursor model(cursor.take_bytes(cursor.count(1)));
      if (cursor.ok() && kind == Model::rigid_body) take_model(model, kind, version, names);
      if (!model.ok()) return false;
    } else if (!take_model(cursor, kind, version, names)) {
      return false;
    }
  }
  return cursor.ok();
}

bool decode_natnet_frame(std::span<const std::byte> contents, const NatnetDialect& dialect,
                         SentFrame& frame, NatnetNews& news) noexcept {
  const NatnetVersion& version = dialect.version;
  LittleEndianCursor cursor(contents);
  frame.frame_number = cursor.take<std::int32_t>();
  skip_section(cursor, version, kLeastSet, [&] {
    cursor.take_text();
    cursor.skip_list(kPoint);
  });
  skip_section(cursor, version, kPoint, [&] { cursor.skip(kPoint); });  // markers of no set
  take_bodies(cursor, version, frame);
  skip_section(cursor, version, kLeastSkeleton, [&] {
    cursor.skip(4);
    cursor.skip_list(kRigidBody);
  });
  if (version >= kSizes) skip_section(cursor, version, 1, [] {});  // assets
  skip_section(cursor, version, kLabelledMarker, [&] { cursor.skip(kLabelledMarker); });
  skip_section(cursor, version, kLeastDevice, [&] { skip_device(cursor); });  // of force
  skip_section(cursor, version, kLeastDevice, [&] { skip_device(cursor); });
  cursor.skip(4 + 4);  // time code
  const auto timestamp_s = cursor.take<double>();
  const auto exposure_ticks = cursor.take<std::uint64_t>();
  cursor.skip(8 + 8);                         // data received, sent
  if (version >= kSizes) cursor.skip(4 + 4);  // precision time
  const auto flags = cursor.take<std::uint16_t>();
  if (!cursor.ok() || cursor.left() > kLongestTail) return false;
  news = {.models_changed = (flags & kModelsChanged) != 0,
          .version_changed = (flags & kVersionChanged) != 0};
  frame.sender_time_us = exposure_ticks != 0 && dialect.ticks_per_s != 0
                             ? ticks_to_us(exposure_ticks, dialect.ticks_per_s)
                             : to_us(timestamp_s);
  return true;
}

namespace {

/// A packet: its length follows when it is complete.
class NatnetPacket {
 public:
  NatnetPacket(NatnetMessage kind, std::vector<std::byte>& out) : out_(out), writer_(out) {
    out.clear();
    writer_.put(static_cast<std::uint16_t>(kind));
    writer_.put(std::uint16_t{0});
  }
  ~NatnetPacket() { writer_.put_at(2, static_cast<std::uint16_t>(out_.size() - 4)); }
  NatnetPacket(const NatnetPacket&) = delete;
  NatnetPacket& operator=(const NatnetPacket&) = delete;

  ByteWriter* operator->() { return &writer_; }
  /// Puts the size of what `write` puts before it, where the version has sizes.
  template <class Write>
  void sized(const NatnetVersion& version, const Write& write) {
    const std::size_t at = out_.size();
    if (version >= kSizes) writer_.put(std::int32_t{0});
    write();
    if (version >= kSizes)
      writer_.put_at(at, static_cast<std::int32_t>(out_.size() - at - sizeof(std::int32_t)));
  }
  void empty_section(const NatnetVersion& version) {
    writer_.put(std::int32_t{0});
    sized(version, [] {});
  }

 private:
  std::vector<std::byte>& out_;
  ByteWriter writer_;
};

}  // namespace

void encode_natnet_server(const NatnetDialect& dialect, std::vector<std::byte>& out) {
  NatnetPacket packet(NatnetMessage::server_info, out);
  packet->put_text("softarm-plant");
  out.resize(4 + kApplicationName);
  for (const int number : {1, 0, 0, 0, dialect.version.major, dialect.version.minor, 0, 0})
    packet->put(static_cast<std::uint8_t>(number));
  packet->put(dialect.ticks_per_s);
}

void encode_natnet_models(const NatnetVersion& version, const BodyNames& names,
                          std::vector<std::byte>& out) {
  NatnetPacket packet(NatnetMessage::models, out);
  packet->put(static_cast<std::int32_t>(names.bodies().size()));
  for (const NamedBody& body : names.bodies()) {
    packet->put(static_cast<std::int32_t>(Model::rigid_body));
    packet.sized(version, [&] {
      packet->put_text(body.name);
      packet->put(body.id);
      packet->put(std::int32_t{-1});
      const int numbers = version >= kRotations ? 7 : 3;
      for (int k = 0; k < numbers; ++k) packet->put(k == 6 ? 1.0F : 0.0F);
      packet->put(std::int32_t{0});  // markers
    });
  }
}

void encode_natnet_frame(const SentFrame& frame, const NatnetDialect& dialect,
                         std::vector<std::byte>& out) {
  const NatnetVersion& version = dialect.version;
  NatnetPacket packet(NatnetMessage::frame, out);
  packet->put(static_cast<std::int32_t>(frame.frame_number));
  packet.empty_section(version);  // marker sets
  packet.empty_section(version);  // other markers
  packet->put(static_cast<std::int32_t>(frame.bodies));
  packet.sized(version, [&] {
    for (const SentBody& body : std::span(frame.body).first(frame.bodies)) {
      packet->put(body.id);
      for (const double each : body.position) packet->put(static_cast<float>(each));
      for (const double each : body.orientation) packet->put(static_cast<float>(each));
      packet->put(0.0F);
      packet->put(body.seen ? kTracked : std::uint16_t{0});
    }
  });
  const int empty = version >= kSizes ? 5 : 4;  // skeletons, assets, markers, force, devices
  for (int k = 0; k < empty; ++k) packet.empty_section(version);
  packet->put(std::uint64_t{0});  // time code
  packet->put(1e-6 * static_cast<double>(frame.sender_time_us));
  const auto ticks =
      static_cast<std::uint64_t>(frame.sender_time_us) * (dialect.ticks_per_s / 1'000'000);
  for (int k = 0; k < 3; ++k) packet->put(ticks);
  if (version >= kSizes) packet->put(std::uint64_t{0});
  packet->put(std::uint16_t{0});
  packet->put(std::uint32_t{0});  // end
}

}  // namespace softarm
