// SPDX-License-Identifier: Apache-2.0
// Objects 5F00h to 5F18h and 5F80h of the IXXAT manual (5.12, 5.13), in the dictionary of a line's
// own node. All are read only.
//   5F00h  1 event indication U16   2 state U16: low byte network_state.h, high byte communication
//          3 communication U8       see global_events.h
//   5F01h..5F07h  1..4 U32: NodeLists in their order
//   5F10h  1..127 U8: EMCYs received from the node
//   5F11h..5F17h  U8: EMCYs received of kEmcyClasses
//   5F18h  1..127 DOMAIN: EmcyRecord::history(); 0800 0021h for the own node
//   5F80h  1..3 U8: the manual's task times. There is no cyclic task, because everything runs when
//          it is due: 0 ms, 0 ms and 100 %
#pragma once

#include <cstdint>

#include "stack/diagnosis/diagnosis.h"
#include "stack/od/dictionary.h"
#include "stack/od/hook.h"

namespace linegate::diagnosis {

// Call it before the node with this dictionary is created. Fails if one of the objects exists.
Result<void> add_objects(od::Dictionary& dictionary);

// Updates the objects when they are read; reports requests written to 1F82h.
class Objects final : public od::Hook {
 public:
  // All references must outlive this object.
  Objects(od::Dictionary& dictionary, Diagnosis& diagnosis, std::uint8_t own_node);
  ~Objects() override;
  Objects(const Objects&) = delete;
  Objects& operator=(const Objects&) = delete;

  AbortCode before_read(od::Address address, const od::Variable& variable) override;
  void written(od::Address address) override;

 private:
  void set_hooks(od::Hook* hook);
  std::uint64_t number(od::Address address) const;

  od::Dictionary& dictionary_;
  Diagnosis& diagnosis_;
  std::uint8_t own_node_;
};

}  // namespace linegate::diagnosis
