// SPDX-License-Identifier: Apache-2.0
// Compares the PDOs of a node with those of the process image, and corrects them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "stack/base/abort_code.h"
#include "stack/manager/assumed_pdo.h"
#include "stack/manager/node_report.h"
#include "stack/manager/node_tasks.h"
#include "stack/od/description.h"

namespace linegate::manager {

// Whether a node with that value has the PDO that is expected: bit 30 of a COB-ID, the length of
// any other number and the kind of event (transmission types 254 and 255) make no difference.
bool is_same_parameter(od::Address address, std::span<const std::byte> expected,
                       std::span<const std::byte> found);
// Whether a node may have that value of a parameter of the PDO.
bool is_as_assumed(const AssumedPdo& pdo, const ObjectWrite& parameter,
                   std::span<const std::byte> found);

// Whether a write of this value may change a parameter of one of these PDOs. value: empty if it is
// not known.
bool changes_pdo(std::span<const AssumedPdo> pdos, od::Address address,
                 std::span<const std::byte> value);

// Whether a write of this value may end the transmission of one of these TPDOs: with types 252 and
// 253 it is sent on request alone, with the synchronous types only while there is SYNC. The values
// of the image would stay as they are. With the other types it is sent by itself. value: empty if
// it is not known.
bool ends_transmission(std::span<const AssumedPdo> pdos, od::Address address,
                       std::span<const std::byte> value, bool has_sync);

// The node does not have the object, or it cannot be read: nothing is known of it.
bool is_unreadable(AbortCode abort);

// Reads these parameters, except those that were just written, and writes a PDO that differs, which
// is then read again. If it differs still, it is written a second time: a node that was switched
// off and on may answer with its stored values before its boot-up message is received. A read that
// is not answered is repeated once: a frame may have been lost, and until the check has ended a
// node that was kept alive receives no outputs. Parameters that the node does not have, or never
// lets read, count as expected, because nothing else is known of them.
class PdoCheck {
 public:
  PdoCheck() = default;
  // written: the configuration that the node has just received; a later write of an object
  // replaces an earlier one.
  PdoCheck(std::vector<AssumedPdo> pdos, std::span<const ObjectWrite> written);

  bool done() const { return pdo_ == pdos_.size() || fault_.has_value(); }
  // The next transfer. Precondition: !done().
  TaskStep step() const;
  void take(AbortCode abort, std::span<const std::byte> data);
  // Why the check ended: a transfer failed, or a parameter differs and the remedy does not write
  // it, or without success. Nothing: no difference is known.
  const std::optional<Difference>& fault() const { return fault_; }
  // The fault is an upload that the node may permit later, for example when it has started.
  bool may_succeed_later() const {
    return fault_ && fault_->abort != AbortCode::none && !corrects_;
  }

 private:
  void skip_written();
  void differs(const ObjectWrite& expected, std::span<const std::byte> found);
  void note_cob_id(od::Address address, std::span<const std::byte> data);
  std::vector<std::byte> remedy_value() const;
  const ObjectWrite* written(od::Address address) const;

  std::vector<AssumedPdo> pdos_;
  std::vector<ObjectWrite> written_;
  std::size_t pdo_ = 0;
  std::size_t next_ = 0;  // of its parameters, or of its remedy
  bool corrects_ = false;
  unsigned corrections_ = 0;        // of this PDO
  bool repeats_ = false;            // the read was not answered the first time
  std::uint32_t found_cob_id_ = 0;  // of this PDO, as read
  std::optional<Difference> fault_;
};

}  // namespace linegate::manager
