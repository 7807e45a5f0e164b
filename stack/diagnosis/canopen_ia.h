// SPDX-License-Identifier: Apache-2.0
// The records of the CANopenIA manual (6.1 to 6.4) in the dictionary of a line's own node: with the
// manual's sub-indices, but from another base index on, because the IXXAT objects occupy the
// manual's indices.
//   base + 0   status, read only    1 node-ID U8   2 own NMT state U8   3 hardware U8, see below
//              4 kind and version U32: bits 8..15 02h manager, 01h device; 16..23 major, 24..31
//              minor version, of 1018h:3    5 serial number, DOMAIN of 16 bytes, that of 1018h:4
//   base + 1   control, control_record.h; rw unless another access is named
//              1 reset U8 wo: 129 reset communication, 130 reset node (of the own node)
//              2 sleep objection U8: 1 the own node objects to sleep (CiA 447)
//              4 manager control U32: bit 0 keep nodes operational, 4 answer reads of nodes with
//              scanned values, 5 writes by object use SDO, 6 PDOs are sent when they are
//              triggered; the others are fixed    5 heartbeat producer time that is set up at nodes
//              that a scan finds without error control, U16 ms, not 0   6 ro: 2.5 times that
//              7 PDO update time U8 ms   8 event time U16 ms, 9 inhibit time U16 100 us of all
//              event-driven TPDOs; until they are written they read 0, and the times are as
//              configured
//              Ah scan of a node U8 wo: node-ID   Bh generic CAN U8: 01h transmit, 10h receive,
//              11h both by base + Ch   Ch trigger of a PDO U16 wo: high byte node-ID, low byte
//              number of its RPDO
//   base + 4   1..127 U8: the last known status of the node, node_status.h; 0800 0024h if
//              there is none
//   base + Ah  1 NMT U16 wo: high byte node-ID, 0 = all; low byte command specifier
//   base + Ch  1..8 rw: generic CAN frames with that number of bytes, see frame_record(). Write:
//              sends the frame. Read: the last frame received, 0800 0024h if there is none
// Settings last until the line is created again; no reset changes them.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <span>
#include <utility>

#include "stack/base/abort_code.h"
#include "stack/base/result.h"
#include "stack/can/frame.h"
#include "stack/diagnosis/control_record.h"
#include "stack/diagnosis/diagnosis.h"
#include "stack/nmt/state.h"
#include "stack/od/description.h"
#include "stack/od/dictionary.h"
#include "stack/od/hook.h"
#include "stack/od/objects.h"

namespace linegate::diagnosis {

// CAN frames that belong to no CANopen service, as values of an object (CANopenIA manual 6.2,
// 5F0Ch): the sub-index is the number of data bytes, 1..8; the value is the 11-bit identifier as
// U16, then the data.
//
// OCTET_STRINGs. Sub-index 0 is the highest sub-index, as in every record (CiA 301, 7.4.5.2), so
// there is no sub-index for a frame without data.
od::ObjectDescription frame_record(std::uint16_t index);

// Decodes a written value. Fails with length_too_high, length_too_low, or invalid_value for an
// identifier of more than 11 bits.
Result<can::Frame> frame_of(std::uint8_t sub, std::span<const std::byte> value);

// The last received frame of each length.
class HeardFrames {
 public:
  // Ignores frames that the record cannot hold (29 bits, remote, CAN FD).
  void note(const can::Frame& frame);
  // In the format of the record; empty if no frame was received. length: 1..8.
  std::span<const std::byte> last(std::uint8_t length) const;

 private:
  struct Heard {
    std::array<std::byte, sizeof(std::uint16_t) + can::kMaxClassicData> bytes{};
    std::uint8_t size = 0;
  };
  std::array<Heard, can::kMaxClassicData + 1> heard_{};
};

// The services that the CANopenIA records need from the line.
class RecordHost {
 public:
  virtual ~RecordHost() = default;

  struct Transmission {
    bool fd = false;       // the interface supports CAN FD
    bool waiting = false;  // a frame waits for the bus, or a PDO for its inhibit time
    bool overrun = false;  // a frame was rejected by a full queue since the line was created
  };
  virtual Transmission transmission() const = 0;

  // Whether node 1..127 can be scanned now, and whether the TPDO that is RPDO `number` of the node
  // can be triggered now. none: it can; invalid_value: it does not exist; local_control: the line
  // is not the manager; device_state: not in the present state.
  virtual AbortCode may_scan(std::uint8_t node) const = 0;
  virtual AbortCode may_trigger(std::uint8_t node, std::uint8_t number) const = 0;

  // Sends a frame after all other queued frames. local_control if a service uses its identifier,
  // device_state if there is no bus or no room.
  virtual AbortCode transmit(const can::Frame& frame) = 0;

  // The network sleeps: no order can be carried out.
  virtual bool sleeps() const { return false; }
};

inline constexpr std::uint16_t kCanopenIaLast = 0x0C;  // after the base
// Whether the records from this base on fit into 5F00h to 5FFFh beside the other objects of the own
// node.
constexpr bool is_free_for_records(std::uint16_t base) {
  return base >= od::objects::kLowestCanopenIa && base <= od::objects::kHighestCanopenIa &&
         (base > od::objects::kTaskTimes || base + kCanopenIaLast < od::objects::kTaskTimes);
}

// Bits of the hardware state.
inline constexpr std::uint8_t kHardwareInitialised = 1U << 0U;
inline constexpr std::uint8_t kHardwareErrors = 1U << 1U;   // error frames were seen
inline constexpr std::uint8_t kHardwarePassive = 1U << 2U;  // present state
inline constexpr std::uint8_t kHardwareOverrun = 1U << 3U;  // frames were lost on reception
inline constexpr std::uint8_t kHardwareTransmitOverrun = 1U << 4U;
inline constexpr std::uint8_t kHardwareFd = 1U << 5U;
inline constexpr std::uint8_t kHardwareTransmits = 1U << 6U;  // a frame waits
inline constexpr std::uint8_t kHardwareBusOff = 1U << 7U;     // present state

struct CanopenIaOptions {
  std::uint16_t base = od::objects::kCanopenIa;
  std::uint8_t own_node = 0;
  bool manager = true;
  std::uint32_t revision = 0;  // 1018h:3
  std::uint32_t serial = 0;    // 1018h:4
  ControlSettings settings{};
};

Result<void> add_canopen_ia(od::Dictionary& dictionary, std::uint16_t base);

class CanopenIa final : public od::Hook {
 public:
  // The kind of an order.
  enum class OrderKind : std::uint8_t { nmt, scan, trigger };
  struct Order {
    nmt::Command command = nmt::Command::start;
    std::uint8_t node = 0;  // 0 = all, for NMT commands only
    OrderKind kind = OrderKind::nmt;
    std::uint8_t rpdo = 0;  // number of the RPDO, for OrderKind::trigger
  };
  static constexpr std::size_t kOrders = 8;  // largest number of pending orders

  // All references must outlive this object.
  CanopenIa(od::Dictionary& dictionary, const Diagnosis& diagnosis, RecordHost& host,
            const CanopenIaOptions& options);
  ~CanopenIa() override;
  CanopenIa(const CanopenIa&) = delete;
  CanopenIa& operator=(const CanopenIa&) = delete;

  const ControlSettings& settings() const { return options_.settings; }
  bool keep_operational() const { return settings().keep_operational; }
  // Removes the oldest order, which the caller carries out after the access that wrote it. False if
  // there is none.
  bool take(Order& out);
  // True once after event time or inhibit time was written.
  bool pop_pdo_times_written() { return std::exchange(pdo_times_written_, false); }
  // An order or new PDO times are pending.
  bool waits() const { return !orders_.empty() || pdo_times_written_; }

  // Call it with each frame that no service consumes. True if such frames are to be reported.
  bool hear(const can::Frame& frame) {
    if (!options_.settings.receives_frames) [[likely]] {
      return false;
    }
    heard_.note(frame);
    return true;
  }

  AbortCode before_read(od::Address address, const od::Variable& variable) override;
  // invalid_value for a value that is not a command; local_control for a command that needs a
  // manager; device_state if kOrders orders are pending or the network sleeps, and for frames while
  // they are not enabled; otherwise the result of RecordHost.
  AbortCode check_write(od::Address address, std::span<const std::byte> value) override;
  AbortCode execute_write(od::Address address, std::span<const std::byte> value) override;

 private:
  std::uint16_t offset(od::Address address) const {
    return static_cast<std::uint16_t>(address.index - options_.base);
  }
  bool is_setting(od::Address address) const;
  std::optional<Order> order_of(od::Address address, std::uint64_t value) const;
  AbortCode read_status(od::Address address, const od::Variable& variable);
  AbortCode read_frame(od::Address address);
  std::uint8_t hardware() const;
  std::uint32_t kind_and_version() const;
  AbortCode check_order(const Order& order) const;
  AbortCode check_frame(od::Address address, std::span<const std::byte> value) const;
  void set_hooks(od::Hook* hook);

  od::Dictionary& dictionary_;
  const Diagnosis& diagnosis_;
  RecordHost& host_;
  CanopenIaOptions options_;
  std::deque<Order> orders_;
  bool pdo_times_written_ = false;
  HeardFrames heard_;
};

}  // namespace linegate::diagnosis
