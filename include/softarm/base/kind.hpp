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

/// A value of one of several types, known by what `Interface` asks of them. Copies share it: it
/// does not change. `Interface` has a virtual destructor and `const char* name() const noexcept`.
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

 protected:
  template <class Value>
  struct Holder : Interface {
    explicit Holder(Value it) : value(std::move(it)) {}
    const char* name() const noexcept override { return value.name(); }
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
