// SPDX-License-Identifier: Apache-2.0
// The records of the CANopenIA manual (6.1 to 6.4) in the dictionary of a line's own node: its
// sub-indices, from a base on, because the IXXAT objects have the manual's indices.
//   base + 0   status, read only    1 node-ID U8   2 own NMT state U8   3 hardware U8, see below
//              4 kind and version U32: bits 8..15 02h manager, 01h device; 16..23 major, 24..31
//              minor version, of 1018h:3    5 serial number, DOMAIN of 16 bytes, that of 1018h:4
//   base + 1   control, control_record.h; rw unless another access is named
//              1 reset U8 wo: 129 reset communication, 130 reset node (of the own node)
//              4 manager control U32: bit 0 keep nodes operational, 4 answer reads of nodes with
//              what a scan read, 5 writes by object go by SDO, 6 PDOs are sent when they are
//              triggered; the others are fixed    5 heartbeat producer time that is set up at nodes
//              that a scan finds without error control, U16 ms, not 0   6 ro: 2.5 times that
//              7 PDO update time U8 ms   8 event time U16 ms, 9 inhibit time U16 100 us of all
//              event-driven TPDOs; 0, and they are as configured, until it is written
//              Ah scan of a node U8 wo: node-ID   Bh generic CAN U8: 01h transmit, 10h receive,
//              11h both by base + Ch   Ch trigger of a PDO U16 wo: high byte node-ID, low byte
//              number of its RPDO
//   base + 4   1..127 U8: the last that became known of the node, node_status.h; 0800 0024h if
//              nothing did
//   base + Ah  1 NMT U16 wo: high byte node-ID, 0 = all; low byte command specifier
//   base + Ch  1..8 rw: generic CAN frames of so many bytes, see frame_record.h. Written: sent.
//              Read: the last that came, 0800 0024h if none did
// What is set lasts until the line is made anew, whatever is reset.
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

// CAN frames of no CANopen service as values of an object (CANopenIA manual 6.2, 5F0Ch): the
// sub-index is the number of data bytes, 1..8; the value U16 identifier of 11 bits, then the data.
//
// OCTET_STRINGs. Sub-index 0 is the highest one, as in every record (CiA 301, 7.4.5.2), so that a
// frame without data has no place.
od::ObjectDescription frame_record(std::uint16_t index);

// The frame that is written. length_too_high, length_too_low; invalid_value for an identifier of
// more than 11 bits.
Result<can::Frame> frame_of(std::uint8_t sub, std::span<const std::byte> value);

// The last of each length that came.
class HeardFrames {
 public:
  // Frames that the record cannot hold (29 bits, remote, CAN FD) are left out.
  void note(const can::Frame& frame);
  // As the record holds it; empty if none came. length: 1..8.
  std::span<const std::byte> last(std::uint8_t length) const;

 private:
  struct Heard {
    std::array<std::byte, sizeof(std::uint16_t) + can::kMaxClassicData> bytes{};
    std::uint8_t size = 0;
  };
  std::array<Heard, can::kMaxClassicData + 1> heard_{};
};

// What the CANopenIA records ask of the line, and order of it.
class RecordHost {
 public:
  virtual ~RecordHost() = default;

  struct Transmission {
    bool fd = false;       // the interface is one of CAN FD
    bool waiting = false;  // something waits for the bus, or for its inhibit time
    bool overrun = false;  // a queue was too full for a frame since the line was made
  };
  virtual Transmission transmission() const = 0;

  // Whether the node, 1..127, can be scanned now, and the TPDO triggered that is RPDO `number` of
  // the node: none; invalid_value for what is not there; local_control if the line does not manage;
  // device_state if it is not the time for it.
  virtual AbortCode may_scan(std::uint8_t node) const = 0;
  virtual AbortCode may_trigger(std::uint8_t node, std::uint8_t number) const = 0;

  // Sends a frame behind all else. local_control if a service uses its identifier, device_state if
  // there is no bus or no room.
  virtual AbortCode transmit(const can::Frame& frame) = 0;
};

inline constexpr std::uint16_t kCanopenIaLast = 0x0C;  // after the base
// Where the records may be: beside the other objects of a line's own node from 5F00h to 5FFFh.
constexpr bool is_free_for_records(std::uint16_t base) {
  return base >= od::objects::kLowestCanopenIa && base <= od::objects::kHighestCanopenIa &&
         (base > od::objects::kTaskTimes || base + kCanopenIaLast < od::objects::kTaskTimes);
}

// Bits of the hardware state.
inline constexpr std::uint8_t kHardwareInitialised = 1U << 0U;
inline constexpr std::uint8_t kHardwareErrors = 1U << 1U;   // error frames were seen
inline constexpr std::uint8_t kHardwarePassive = 1U << 2U;  // now
inline constexpr std::uint8_t kHardwareOverrun = 1U << 3U;  // frames were lost on reception
inline constexpr std::uint8_t kHardwareTransmitOverrun = 1U << 4U;
inline constexpr std::uint8_t kHardwareFd = 1U << 5U;
inline constexpr std::uint8_t kHardwareTransmits = 1U << 6U;  // something waits
inline constexpr std::uint8_t kHardwareBusOff = 1U << 7U;     // now

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
  // What was ordered by a write.
  enum class OrderKind : std::uint8_t { nmt, scan, trigger };
  struct Order {
    nmt::Command command = nmt::Command::start;
    std::uint8_t node = 0;  // of an NMT command 0 = all
    OrderKind kind = OrderKind::nmt;
    std::uint8_t rpdo = 0;  // its number, of a trigger
  };
  static constexpr std::size_t kOrders = 8;  // that wait

  // All must outlive it.
  CanopenIa(od::Dictionary& dictionary, const Diagnosis& diagnosis, RecordHost& host,
            const CanopenIaOptions& options);
  ~CanopenIa() override;
  CanopenIa(const CanopenIa&) = delete;
  CanopenIa& operator=(const CanopenIa&) = delete;

  const ControlSettings& settings() const { return options_.settings; }
  bool keep_operational() const { return settings().keep_operational; }
  // The oldest order: it is carried out when the access that gave it is over. False if none waits.
  bool take(Order& out);
  // True once when event or inhibit time were written.
  bool take_pdo_times() { return std::exchange(pdo_times_written_, false); }
  // There is something to be taken.
  bool waits() const { return !orders_.empty() || pdo_times_written_; }

  // A frame that no service wants: true if all such are to be told.
  bool hear(const can::Frame& frame) {
    if (!options_.settings.receives_frames) [[likely]] {
      return false;
    }
    heard_.note(frame);
    return true;
  }

  AbortCode before_read(od::Address address, const od::Variable& variable) override;
  // invalid_value for what no command is; local_control where only a manager can; device_state with
  // kOrders waiting, for frames while they are not enabled, and whatever RecordHost says.
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
