// The keys of an experiment, declared once each (keys.hpp), in the order in which they are
// printed.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "softarm/config/config_keys.hpp"
#include "softarm/config/experiment.hpp"

namespace softarm {

/// Declares a key with the name of the member of `it` that it sets.
#define KEY(member, ...) key(#member, it.member, __VA_ARGS__)
/// The same of a list of so many numbers, which are 0 where none are known.
#define LIST(member, size, ...) \
  (it.member.resize(static_cast<std::size_t>(size), 0.0), KEY(member, __VA_ARGS__))

inline constexpr double kTwoPi = 6.283185307179586;
inline constexpr double kMany = 1e6;
inline constexpr auto kRequired = Presence::required;

void describe(Keys& key, Experiment& it);

// Its parts, in separate files.
void describe_daemon(Keys& key, Experiment& it);
void describe(Keys& key, ValveDriverSettings& it);
void describe_reference(Keys& key, ReferenceSettings& it);
/// The simulated arm starts from the values of the controller's keys.
void describe_plant(Keys& key, Experiment& experiment);
/// Without required keys where the variables hold values of other sections.
void describe_arm(Keys& key, ArmParameters& it, Presence presence);
void describe_actuation(Keys& key, ActuationSettings& it, Presence presence);

/// The name of one of several kinds.
template <class T>
void describe_choice(Keys& key, const char* name, const Registry<T>& known, T& chosen,
                     const char* doc, Presence presence = Presence::optional) {
  const auto names = known.names();
  std::size_t index = known.index(chosen.name());
  key(name, index, one_of(names), doc, presence);
  if (key.reading()) chosen = known.all()[index];
}
/// The same, and a section for every kind that has keys, whichever is chosen.
template <class T>
void describe_kind(Keys& key, const char* name, const Registry<T>& known, T& chosen,
                   const char* doc, const char* section_doc) {
  describe_choice(key, name, known, chosen, doc);
  for (T kind : known.all()) {
    if (!kind.has_keys()) continue;
    const bool it_is = std::string_view(kind.name()) == chosen.name();
    key.section({kind.name(), section_doc}, [&] { (it_is ? chosen : kind).describe(key); });
  }
}

/// A channel of section lcm, with its minimum length in characters.
struct ChannelKey {
  const char* name;
  std::string LcmSettings::*channel;
  int fewest;
  const char* doc;
};
extern const std::array<ChannelKey, 15> kChannelKeys;

}  // namespace softarm
