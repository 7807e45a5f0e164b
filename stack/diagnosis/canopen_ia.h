// The records of the CANopenIA manual (6.1 to 6.4) in the dictionary of a line's own node: its
// sub-indices, from a base on, because the IXXAT objects have the manual's indices.
//   base + 0   status, read only    1 node-ID U8   2 own NMT state U8   3 hardware U8, see below
//              4 kind and version U32: bits 8..15 02h manager, 01h device; 16..23 major, 24..31
//              minor version, of 1018h:3    5 serial number, DOMAIN of 16 bytes, that of 1018h:4
//   base + 1   control              1 reset U8 wo: 129 reset communication, 130 reset node (of
//              the own node)   4 manager control U32 rw, see below
//   base + 4   1..127 U8: the last that became known of the node, node_status.h; 0800 0024h if
//              nothing did
//   base + Ah  1 NMT U16 wo: high byte node-ID, 0 = all; low byte command specifier
#pragma once

#include <cstdint>
#include <deque>

#include "stack/diagnosis/diagnosis.h"
#include "stack/nmt/state.h"
#include "stack/od/dictionary.h"
#include "stack/od/hook.h"

namespace linegate::diagnosis {

inline constexpr std::uint16_t kCanopenIaBase = 0x5F40;  // unless configured
inline constexpr std::uint16_t kCanopenIaLast = 0x0A;    // after the base
// Where the records may be: beside the other objects of a line's own node from 5F00h to 5FFFh.
inline constexpr std::uint16_t kLowestBase = 0x5F21;
inline constexpr std::uint16_t kHighestBase = 0x5FF5;
constexpr bool is_free_for_records(std::uint16_t base) {
  constexpr std::uint16_t kTaskTimeObject = 0x5F80;
  return base >= kLowestBase && base <= kHighestBase &&
         (base > kTaskTimeObject || base + kCanopenIaLast < kTaskTimeObject);
}

// Bits of the hardware state.
inline constexpr std::uint8_t kHardwareInitialised = 1U << 0U;
inline constexpr std::uint8_t kHardwareErrors = 1U << 1U;   // error frames were seen
inline constexpr std::uint8_t kHardwarePassive = 1U << 2U;  // now
inline constexpr std::uint8_t kHardwareOverrun = 1U << 3U;  // frames were lost on reception
inline constexpr std::uint8_t kHardwareBusOff = 1U << 7U;   // now

// Bits of the manager control. The others are as they are: all heartbeats and PDOs of configured
// nodes are received and sent, of up to 127 nodes.
inline constexpr std::uint32_t kKeepOperational = 1U << 0U;
inline constexpr std::uint32_t kFixedControl =
    1U << 1U | 1U << 2U | 1U << 3U | 127U << 16U | 127U << 24U;

struct CanopenIaOptions {
  std::uint16_t base = kCanopenIaBase;
  std::uint8_t own_node = 0;
  bool manager = true;
  std::uint32_t revision = 0;  // 1018h:3
  std::uint32_t serial = 0;    // 1018h:4
  bool keep_operational = false;
};

Result<void> add_canopen_ia(od::Dictionary& dictionary, std::uint16_t base);

class CanopenIa final : public od::Hook {
 public:
  // An NMT command that was ordered by a write. node: 0 = all.
  struct Order {
    nmt::Command command = nmt::Command::start;
    std::uint8_t node = 0;
  };
  static constexpr std::size_t kOrders = 8;  // that wait

  // dictionary and diagnosis must outlive it.
  CanopenIa(od::Dictionary& dictionary, const Diagnosis& diagnosis,
            const CanopenIaOptions& options);
  ~CanopenIa() override;
  CanopenIa(const CanopenIa&) = delete;
  CanopenIa& operator=(const CanopenIa&) = delete;

  bool keep_operational() const { return keep_operational_; }
  // The oldest order: it is carried out when the access that gave it is over. False if none waits.
  bool take(Order& out);
  bool waits() const { return !orders_.empty(); }

  AbortCode before_read(od::Address address, const od::Variable& variable) override;
  // invalid_value for what no command is; local_control where only a manager can; device_state with
  // kOrders waiting.
  AbortCode check_write(od::Address address, std::span<const std::byte> value) override;
  AbortCode execute_write(od::Address address, std::span<const std::byte> value) override;

 private:
  std::uint16_t offset(od::Address address) const {
    return static_cast<std::uint16_t>(address.index - options_.base);
  }
  std::uint8_t hardware() const;
  std::uint32_t kind_and_version() const;
  std::uint32_t control() const;
  AbortCode check_order(const Order& order) const;
  void set_hooks(od::Hook* hook);

  od::Dictionary& dictionary_;
  const Diagnosis& diagnosis_;
  CanopenIaOptions options_;
  bool keep_operational_;
  std::deque<Order> orders_;
};

}  // namespace linegate::diagnosis
