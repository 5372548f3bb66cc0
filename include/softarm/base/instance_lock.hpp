// At most one instance of a program per name.
#pragma once

#include <stdexcept>
#include <string>

namespace softarm {

/// Another process holds the lock.
class OtherInstance : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Prevents a second process from taking the same name for as long as the object exists. Leaves no
/// file behind, however the process ends.
class InstanceLock {
 public:
  /// @throws OtherInstance if another process holds `name`; std::runtime_error if no lock can be
  /// taken at all
  explicit InstanceLock(const std::string& name);
  ~InstanceLock();
  InstanceLock(const InstanceLock&) = delete;
  InstanceLock& operator=(const InstanceLock&) = delete;

 private:
  int socket_ = -1;
};

}  // namespace softarm
