#include "transport/mocap_names.hpp"

#include <algorithm>
#include <span>

namespace softarm {
namespace {

constexpr std::int32_t kNobody = -2;  // -1 is a base that is not tracked

}  // namespace

BodyNames::BodyNames(const BodySettings& bodies) {
  if (bodies.base_id >= 0) bodies_.push_back({bodies.base_marker_frame.name, bodies.base_id, {}});
  for (std::size_t i = 0; i < bodies.segment_ids.size(); ++i)
    bodies_.push_back({i < bodies.segment_marker_frames.size()
                           ? bodies.segment_marker_frames[i].name
                           : std::string(),
                       bodies.segment_ids[i],
                       {}});
  used_ = std::any_of(bodies_.begin(), bodies_.end(),
                      [](const NamedBody& body) { return !body.name.empty(); });
  forget();
}

void BodyNames::forget() noexcept {
  for (NamedBody& body : bodies_) {
    body.sent_id.reset();
    if (body.name.empty()) body.sent_id = body.id;
  }
}

void BodyNames::note(std::string_view name, std::int32_t sent_id) noexcept {
  for (NamedBody& body : bodies_)
    if (!body.name.empty() && body.name == name) body.sent_id = sent_id;
}

const NamedBody* BodyNames::missing() const noexcept {
  const auto found = std::find_if(bodies_.begin(), bodies_.end(),
                                  [](const NamedBody& body) { return !body.sent_id; });
  return found == bodies_.end() ? nullptr : &*found;
}

void BodyNames::translate(SentFrame& frame) const noexcept {
  if (!used_) return;
  for (SentBody& sent : std::span(frame.body).first(frame.bodies)) {
    const auto found = std::find_if(bodies_.begin(), bodies_.end(), [&](const NamedBody& body) {
      return body.sent_id && *body.sent_id == sent.id;
    });
    sent.id = found == bodies_.end() ? kNobody : found->id;
  }
}

}  // namespace softarm
