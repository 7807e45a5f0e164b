// SPDX-License-Identifier: Apache-2.0
// Replaces the functions with which Fast DDS 2.9.1 compares a writer or reader of this process with
// the own permissions. So each participant of the test program is a hostile one: it announces
// whatever it is told to, and only the other participants can refuse it.
#include <cstdint>
#include <string>
#include <vector>

namespace eprosima::fastrtps::rtps::security {

class Handle;
class SecurityException;

class Permissions {
 public:
  bool check_create_datawriter(const Handle& handle, std::uint32_t domain, const std::string& topic,
                               const std::vector<std::string>& partitions,
                               SecurityException& exception);
  bool check_create_datareader(const Handle& handle, std::uint32_t domain, const std::string& topic,
                               const std::vector<std::string>& partitions,
                               SecurityException& exception);
};

bool Permissions::check_create_datawriter(const Handle& /*handle*/, std::uint32_t /*domain*/,
                                          const std::string& /*topic*/,
                                          const std::vector<std::string>& /*partitions*/,
                                          SecurityException& /*exception*/) {
  return true;
}

bool Permissions::check_create_datareader(const Handle& /*handle*/, std::uint32_t /*domain*/,
                                          const std::string& /*topic*/,
                                          const std::vector<std::string>& /*partitions*/,
                                          SecurityException& /*exception*/) {
  return true;
}

}  // namespace eprosima::fastrtps::rtps::security
