// A kind of simulated arm behind one interface: what `plant.kind` names. A new one is an equation
// of motion, its settings and one line:
//
//   class RopeSystem final : public PlantSystem { ... };
//   struct Rope {
//     int knots = 10;
//     const char* name() const noexcept { return "rope"; }
//     void describe(Keys& key) { key("knots", knots, from(1, 100), "of the whole rope"); }
//     std::unique_ptr<PlantSystem> make(const PlantSettings& settings) const {
//       return std::make_unique<RopeSystem>(settings, knots);
//     }
//   };
//   const PlantRegistration kRope(Rope{});
#pragma once

#include <memory>

#include "softarm/base/kind.hpp"
#include "softarm/simulation/plant_system.hpp"

namespace softarm {

/// `make` throws std::invalid_argument "plant.KEY: expected X, got Y" for settings that cannot be.
template <class K>
concept AnyPlant = requires(const K& kind, const PlantSettings& settings) {
  { kind.name() }
  noexcept->std::convertible_to<const char*>;
  { kind.make(settings) } -> std::same_as<std::unique_ptr<PlantSystem>>;
};

/// What a kind of plant is, behind PlantKind.
class PlantInterface {
 public:
  virtual ~PlantInterface() = default;
  virtual const char* name() const noexcept = 0;
  virtual bool has_keys() const noexcept = 0;
  virtual std::shared_ptr<const PlantInterface> described(Keys& key) const = 0;
  virtual std::unique_ptr<PlantSystem> make(const PlantSettings& settings) const = 0;
};

/// One kind with its own settings.
class PlantKind : public NamedKind<PlantInterface> {
 public:
  PlantKind();  ///< pcc

  template <AnyPlant K>
  PlantKind(K kind) : NamedKind(std::make_shared<Model<K>>(std::move(kind))) {}

  /// Whether a configuration has a section `plant.NAME` for it.
  bool has_keys() const noexcept { return model().has_keys(); }
  /// The mechanics of the arm that `settings` describe, whose `kind` is this one.
  std::unique_ptr<PlantSystem> make(const PlantSettings& settings) const {
    return model().make(settings);
  }

 private:
  template <class K>
  struct Model final : Holder<K> {
    using Holder<K>::Holder;
    bool has_keys() const noexcept override { return HasKeys<K>; }
    std::shared_ptr<const PlantInterface> described(Keys& key) const override {
      return this->template described_as<Model>(key);
    }
    std::unique_ptr<PlantSystem> make(const PlantSettings& settings) const override {
      return this->value.make(settings);
    }
  };
};

/// The kinds that a configuration may name, with their default settings.
Registry<PlantKind>& plant_kinds();

/// Adds a kind: the one line that it takes in a program of one's own.
struct PlantRegistration {
  explicit PlantRegistration(PlantKind kind) { plant_kinds().add(std::move(kind)); }
};

}  // namespace softarm
