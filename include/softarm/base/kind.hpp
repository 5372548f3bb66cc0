// What extension points have in common: values of any type behind one interface, and the list of
// those that may be named.
#pragma once

#include <concepts>
#include <memory>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace softarm {

class Keys;

/// A kind that a configuration may say more of than its name: `describe` declares the keys of its
/// settings (base/keys.hpp).
template <class Value>
concept HasKeys = requires(Value& value, Keys& key) {
  value.describe(key);
};

/// A value of one of several types, known by what `Interface` asks of them. Copies share it: it
/// does not change. `Interface` has a virtual destructor, `const char* name() const noexcept` and
/// `std::shared_ptr<const Interface> described(Keys&) const`, a copy with what was read.
template <class Interface>
class NamedKind {
 public:
  /// As configurations name it.
  const char* name() const noexcept { return model_->name(); }

  /// The value, if it is of this type.
  template <class Value>
  const Value* get_if() const noexcept {
    const auto* holder = dynamic_cast<const Holder<Value>*>(model_.get());
    return holder != nullptr ? &holder->value : nullptr;
  }

  /// Declares the keys of its settings, if it has any.
  void describe(Keys& key) { model_ = model_->described(key); }

 protected:
  /// To derive from, with the rest of `Interface`.
  template <class Value>
  struct Holder : Interface {
    explicit Holder(Value it) : value(std::move(it)) {}
    const char* name() const noexcept override { return value.name(); }
    template <class Model>
    std::shared_ptr<const Interface> described_as(Keys& key) const {
      Value copy = value;
      if constexpr (HasKeys<Value>) copy.describe(key);
      return std::make_shared<Model>(std::move(copy));
    }
    Value value;
  };

  explicit NamedKind(std::shared_ptr<const Interface> model) : model_(std::move(model)) {}
  const Interface& model() const noexcept { return *model_; }

 private:
  std::shared_ptr<const Interface> model_;
};

/// The kinds that this program knows by name: those built in, then those added. Kinds are added
/// before anything is loaded; nothing here is locked.
template <class T>
class Registry {
 public:
  explicit Registry(std::vector<T> built_in) : all_(std::move(built_in)) {}

  /// @throw std::invalid_argument if the name is taken
  void add(T kind) {
    if (find(kind.name()) != nullptr)
      throw std::invalid_argument(std::string("two kinds of the name ") + kind.name());
    all_.push_back(std::move(kind));
  }

  const std::vector<T>& all() const noexcept { return all_; }
  std::vector<const char*> names() const {
    std::vector<const char*> names;
    for (const T& kind : all_) names.push_back(kind.name());
    return names;
  }
  /// Place of a name in `all`. @throw std::invalid_argument if there is none
  std::size_t index(std::string_view name) const {
    const T* kind = find(name);
    if (kind == nullptr)
      throw std::invalid_argument("no kind of the name " + std::string(name) + " was added");
    return static_cast<std::size_t>(kind - all_.data());
  }
  /// nullptr if there is none of this name.
  const T* find(std::string_view name) const noexcept {
    for (const T& kind : all_)
      if (name == kind.name()) return &kind;
    return nullptr;
  }

 private:
  std::vector<T> all_;
};

/// For a list of built-in kinds: what `Type function();` returns, a function that the kind's own
/// file of the same module defines.
#define SOFTARM_KIND_OF_FILE(Type, function) \
  [] {                                       \
    extern Type function();                  \
    return function();                       \
  }()

}  // namespace softarm
