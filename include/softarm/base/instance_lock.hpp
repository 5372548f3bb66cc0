// One instance of a program a name.
#pragma once

#include <stdexcept>
#include <string>

namespace softarm {

/// Another process holds the lock.
class OtherInstance : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Held for the life of the process: keeps a second instance away from the same name. No file is
/// left behind.
class InstanceLock {
 public:
  /// @throws OtherInstance; std::runtime_error if no lock can be taken at all
  explicit InstanceLock(const std::string& name);
  ~InstanceLock();
  InstanceLock(const InstanceLock&) = delete;
  InstanceLock& operator=(const InstanceLock&) = delete;

 private:
  int socket_ = -1;
};

}  // namespace softarm
