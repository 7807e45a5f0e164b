// SPDX-License-Identifier: Apache-2.0
// The communication parameters of one node that SDO transfers on the bus have shown, over its
// resets.
//
// A reset of the node ends written values: reset node and reset communication restore the
// communication parameters to their power-on values, which are the stored ones (CiA 301,
// 7.3.2.2.1). These are the values of the device file, until a transfer shows others:
//   1010h:1, :2 "save" written      the present values are the stored ones
//   1011h:1, :2 "load" written      the values of the device file are the stored ones, whatever is
//                                   read before the reset
//   a value was read that was not   it is the stored one if the boot-up message was received, else
//   written since the boot-up       the stored one is not known, unless it is that of the file;
//                                   bit 30 of the COB-ID of a PDO is that of the device, whatever
//                                   the file says
//   1010h or 1011h written from     sub-index 4 on, which the manufacturer defines: the stored
//                                   values that this may change are not known
//   a value was written             the stored one is not known if 1010h:1 or :2 says, in the
//                                   device file or when it was read, that the device stores by
//                                   itself (bit 1)
//   a value was read that differs   those of the other parameters that the device stores with it
//   from the one taken as stored    are not known, unless they were read since the boot-up, before
//                                   they were written: PdoKnowledge lists them for doubt()
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <vector>

#include "stack/od/description.h"

namespace linegate::observer {

class LearnedParameters {
 public:
  using Value = std::vector<std::byte>;
  // How a client accessed the object, successfully.
  enum class Seen : std::uint8_t { written, read };

  LearnedParameters() = default;
  explicit LearnedParameters(const od::DeviceDescription& device);

  // Processes 1010h and 1011h. No effect for other objects and values.
  void follow_storage(od::Address address, std::span<const std::byte> value, Seen seen);
  // Processes a value of a communication parameter. from_file: its value in the device file, empty
  // if there is none. Returns true if the present value has changed, or was not known.
  bool learn(od::Address address, std::span<const std::byte> value,
             std::span<const std::byte> from_file, Seen seen);
  // Whether a value that learn() has not processed yet shows that the stored value is not the one
  // that it was taken for. from_file: see learn().
  bool refutes_stored(od::Address address, std::span<const std::byte> value,
                      std::span<const std::byte> from_file, Seen seen) const;
  // Another parameter that the device stores with this one has refuted its stored value. The stored
  // value of this one is not known, unless it was read since the last boot-up, before it was
  // written. Nor is the present one, if it is the stored one. from_file: see learn().
  void doubt(od::Address address, std::span<const std::byte> from_file);
  // An NMT command resets the node: the parameters have their stored values from now on.
  void reset();
  // The node has sent its boot-up message: the same.
  void boot_up();

  // Whether all parameters of that index, up to sub-index last, have their known values, or those
  // of the device file.
  bool is_known(std::uint16_t index, std::uint8_t last) const;
  // Calls visit(address, value) for each parameter that was written or read and whose value is
  // known. An empty value: that of a device file without one.
  template <class Visitor>
  void for_each(Visitor visit) const {
    for (const auto& [address, parameter] : parameters_) {
      if (!parameter.unknown) {
        visit(address, parameter.present);
      }
    }
  }

 private:
  struct Parameter {
    Value file;  // its value in the device file
    Value present;
    std::optional<Value> stored;  // its value after a reset; nothing: not known
    bool written = false;         // since the last reset
    bool confirmed = false;       // its stored value was seen since the last reset
    bool unknown = false;         // its present value is not known
  };

  Parameter& parameter(od::Address address, std::span<const std::byte> from_file);
  void store(std::uint8_t sub);
  void restore(std::uint8_t sub);
  void note_stored(Parameter& parameter, od::Address address, std::span<const std::byte> value,
                   Seen seen) const;

  std::map<od::Address, Parameter> parameters_;
  bool stores_itself_ = false;
  // 1011h was written since the last reset: what is read are the values before it, not the stored
  // ones.
  bool restored_ = false;
  bool booted_ = false;  // its boot-up message was received
};

}  // namespace linegate::observer
