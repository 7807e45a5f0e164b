// Which communication errors of the node are present: an EMCY tells the beginning of each, and an
// error reset the end of the last.
#pragma once

#include <array>
#include <bitset>
#include <cstddef>
#include <cstdint>

namespace linegate::node {

enum class Fault : std::uint8_t {
  heartbeat,      // number: node-ID
  rpdo_length,    // number: PDO
  rpdo_too_long,  // number: PDO; its frames are used all the same
  rpdo_deadline,  // number: PDO
  sync_length,    // number: 0
  life_guarding,  // number: 0
  node_id,        // number: 0; another device has it
};

class CommunicationFaults {
 public:
  // True if it was not present before. Numbers above 512 are not kept: never true.
  bool begin(Fault fault, std::uint16_t number) {
    if (number >= kNumbers || present(fault)[number]) {
      return false;
    }
    present(fault).set(number);
    ++count_;
    return true;
  }

  // True if it was present before.
  bool end(Fault fault, std::uint16_t number) {
    if (number >= kNumbers || !present(fault)[number]) {
      return false;
    }
    present(fault).reset(number);
    --count_;
    return true;
  }

  bool any() const { return count_ != 0; }
  void clear() { *this = CommunicationFaults{}; }

 private:
  static constexpr std::size_t kNumbers = 513;

  std::bitset<kNumbers>& present(Fault fault) { return faults_[static_cast<std::size_t>(fault)]; }

  std::array<std::bitset<kNumbers>, 7> faults_{};
  std::size_t count_ = 0;
};

}  // namespace linegate::node
