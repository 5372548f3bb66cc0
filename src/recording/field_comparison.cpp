#include "softarm/recording/field_comparison.hpp"

#include <fmt/format.h>

#include <bit>
#include <type_traits>

#include "softarm/runtime/control_pipeline.hpp"
#include "softarm/runtime/safety_monitor.hpp"

namespace softarm {
namespace {

using namespace softarm_messages;

template <class Number>
bool same(Number a, Number b) {
  if constexpr (std::is_same_v<Number, double>) {
    return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b);
  } else if constexpr (std::is_same_v<Number, float>) {
    return std::bit_cast<std::uint32_t>(a) == std::bit_cast<std::uint32_t>(b);
  } else {
    return a == b;
  }
}

std::string text_of(float value) {
  return fmt::format("{:.9g} ({:08x})", value, std::bit_cast<std::uint32_t>(value));
}
std::string text_of(double value) {
  return fmt::format("{:.17g} ({:016x})", value, std::bit_cast<std::uint64_t>(value));
}
std::string text_of(std::int64_t value) { return fmt::format("{}", value); }

class Collector {
 public:
  template <class Number>
  void operator()(const char* field, const char* unit, Number recorded, Number replayed) {
    if (!same(recorded, replayed)) add(field, unit, recorded, replayed);
  }
  template <class Number>
  void operator()(const char* field, const char* unit, const std::vector<Number>& recorded,
                  const std::vector<Number>& replayed) {
    list(field, unit, recorded, replayed);
  }
  template <class Number>
  void operator()(const char* field, const char* unit,
                  const std::vector<std::vector<Number>>& recorded,
                  const std::vector<std::vector<Number>>& replayed) {
    if (recorded.size() != replayed.size())
      return add(std::string("length of ") + field, "", size_of(recorded), size_of(replayed));
    for (std::size_t i = 0; i < recorded.size(); ++i)
      if (!all_same(recorded[i], replayed[i]))
        list(fmt::format("{}[{}]", field, i), unit, recorded[i], replayed[i]);
  }
  void mode_and_reason(std::int8_t mode_a, std::int8_t mode_b, std::int8_t reason_a,
                       std::int8_t reason_b) {
    const auto text = [](const char* word, int number) {
      return fmt::format("{} ({})", word, number);
    };
    if (mode_a != mode_b)
      found.push_back({"mode", "", text(name(static_cast<Mode>(mode_a)), mode_a),
                       text(name(static_cast<Mode>(mode_b)), mode_b)});
    if (reason_a != reason_b)
      found.push_back({"reason", "", text(name(static_cast<Reason>(reason_a)), reason_a),
                       text(name(static_cast<Reason>(reason_b)), reason_b)});
  }

  std::vector<FieldDifference> found;

 private:
  template <class List>
  static std::int64_t size_of(const List& values) {
    return static_cast<std::int64_t>(values.size());
  }
  template <class Number>
  static bool all_same(const std::vector<Number>& a, const std::vector<Number>& b) {
    if (a.size() != b.size()) return false;
    for (std::size_t k = 0; k < a.size(); ++k)
      if (!same(a[k], b[k])) return false;
    return true;
  }
  template <class Field, class Number>
  void list(const Field& field, const char* unit, const std::vector<Number>& recorded,
            const std::vector<Number>& replayed) {
    if (recorded.size() != replayed.size())
      return add(fmt::format("length of {}", field), "", size_of(recorded), size_of(replayed));
    for (std::size_t k = 0; k < recorded.size(); ++k)
      if (!same(recorded[k], replayed[k]))
        add(fmt::format("{}[{}]", field, k), unit, recorded[k], replayed[k]);
  }
  template <class Number>
  void add(std::string field, const char* unit, Number recorded, Number replayed) {
    if constexpr (std::is_floating_point_v<Number>) {
      found.push_back({std::move(field), unit, text_of(recorded), text_of(replayed)});
    } else {
      found.push_back({std::move(field), unit, text_of(static_cast<std::int64_t>(recorded)),
                       text_of(static_cast<std::int64_t>(replayed))});
    }
  }
};

}  // namespace

// The structured bindings below name every member, so that a new one breaks the build: it must be
// added to the comparison.

std::vector<FieldDifference> differences(const pressure_command_t& recorded,
                                         const pressure_command_t& replayed) {
  const auto& [sequence_a, time_a, validity_a, shadow_a, chambers_a, pressure_a] = recorded;
  const auto& [sequence_b, time_b, validity_b, shadow_b, chambers_b, pressure_b] = replayed;
  Collector compare;
  compare("sequence", "", sequence_a, sequence_b);
  compare("time_us", "us", time_a, time_b);
  compare("validity_us", "us", validity_a, validity_b);
  compare("shadow", "", shadow_a, shadow_b);
  compare("num_chambers", "", chambers_a, chambers_b);
  compare("pressure_bar", "bar", pressure_a, pressure_b);
  return std::move(compare.found);
}

std::vector<FieldDifference> differences(const torque_command_t& recorded,
                                         const torque_command_t& replayed) {
  const auto& [sequence_a, time_a, validity_a, shadow_a, moments_a, torque_a] = recorded;
  const auto& [sequence_b, time_b, validity_b, shadow_b, moments_b, torque_b] = replayed;
  Collector compare;
  compare("sequence", "", sequence_a, sequence_b);
  compare("time_us", "us", time_a, time_b);
  compare("validity_us", "us", validity_a, validity_b);
  compare("shadow", "", shadow_a, shadow_b);
  compare("num_moments", "", moments_a, moments_b);
  compare("torque_nm", "N m", torque_a, torque_b);
  return std::move(compare.found);
}

std::vector<FieldDifference> differences(const controller_status_t& recorded,
                                         const controller_status_t& replayed) {
  const auto& [time_a, tick_a, frame_a, hash_a, seed_a, nonce_a, version_a, mode_a, reason_a,
               flags_a, age_a, accepted_a, rejected_a, refusal_a, repeated_a, missing_a, overruns_a,
               malformed_a, references_refused_a, law_answers_a, round_trip_a, segments_a,
               chambers_a, stretching_a, u_a, velocity_a, reference_a, phi_a, theta_a, tau_a,
               twist_a, length_a, pressure_a, elongation_a, elongation_rate_a, elongation_ref_a,
               axial_a] = recorded;
  const auto& [time_b, tick_b, frame_b, hash_b, seed_b, nonce_b, version_b, mode_b, reason_b,
               flags_b, age_b, accepted_b, rejected_b, refusal_b, repeated_b, missing_b, overruns_b,
               malformed_b, references_refused_b, law_answers_b, round_trip_b, segments_b,
               chambers_b, stretching_b, u_b, velocity_b, reference_b, phi_b, theta_b, tau_b,
               twist_b, length_b, pressure_b, elongation_b, elongation_rate_b, elongation_ref_b,
               axial_b] = replayed;
  Collector compare;
  compare("time_us", "us", time_a, time_b);
  compare("tick", "", tick_a, tick_b);
  compare.mode_and_reason(mode_a, mode_b, reason_a, reason_b);
  compare("flags", "", flags_a, flags_b);
  compare("frame_number", "", frame_a, frame_b);
  compare("frame_age_s", "s", age_a, age_b);
  compare("frames_accepted", "", accepted_a, accepted_b);
  compare("frames_rejected", "", rejected_a, rejected_b);
  compare("refusal", "", int{refusal_a}, int{refusal_b});
  compare("frames_repeated", "", repeated_a, repeated_b);
  compare("frames_missing", "", missing_a, missing_b);
  // Those refused before the pipeline belong to the daemon.
  for (int k = 1; k < kLiveVerdicts; ++k)
    if (const auto why = static_cast<LiveVerdict>(k);
        why != LiveVerdict::wrong_size && why != LiveVerdict::out_of_order)
      compare("references_refused", "", references_refused_a[k], references_refused_b[k]);
  for (int k = 0; k < kLawVerdicts; ++k)
    if (const auto why = static_cast<LawVerdict>(k); why != LawVerdict::not_recent &&
                                                     why != LawVerdict::out_of_order &&
                                                     why != LawVerdict::wrong_size)
      compare("law_answers", "", law_answers_a[k], law_answers_b[k]);
  compare("law_round_trip_s", "s", round_trip_a, round_trip_b);
  compare("num_segments", "", segments_a, segments_b);
  compare("num_chambers", "", chambers_a, chambers_b);
  compare("num_stretching", "", stretching_a, stretching_b);
  compare("u_rad", "rad", u_a, u_b);
  compare("velocity_radps", "rad/s", velocity_a, velocity_b);
  compare("reference_u_rad", "rad", reference_a, reference_b);
  compare("phi_rad", "rad", phi_a, phi_b);
  compare("theta_rad", "rad", theta_a, theta_b);
  compare("tau_actuation_nm", "N m", tau_a, tau_b);
  compare("residual_twist_rad", "rad", twist_a, twist_b);
  compare("residual_length_m", "m", length_a, length_b);
  compare("pressure_bar", "bar", pressure_a, pressure_b);
  compare("elongation_m", "m", elongation_a, elongation_b);
  compare("elongation_rate_mps", "m/s", elongation_rate_a, elongation_rate_b);
  compare("reference_elongation_m", "m", elongation_ref_a, elongation_ref_b);
  compare("axial_force_n", "N", axial_a, axial_b);
  // Not compared: hash_, seed_, nonce_, version_, overruns_ and malformed_ belong to the daemon, not the
  // tick.
  static_cast<void>(hash_a == hash_b && seed_a == seed_b && nonce_a == nonce_b &&
                    version_a == version_b);
  static_cast<void>(overruns_a == overruns_b && malformed_a == malformed_b);
  return std::move(compare.found);
}

std::vector<FieldDifference> differences(const std::vector<double>& recorded,
                                         const std::vector<double>& replayed, const char* unit) {
  Collector compare;
  compare("command", unit, recorded, replayed);
  return std::move(compare.found);
}

}  // namespace softarm
