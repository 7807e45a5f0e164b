// SPDX-License-Identifier: Apache-2.0
// Numbered records of one thread for a thread of another process, in several series.
//
// A record is written once and never changed. Its memory is read-only for the other process, which
// reports the last record of each series that it has carried out in a memory of its own. The writer
// keeps that record and all after it, so that a process that takes over from one that has ended
// begins with it: no number is used twice, and none is left out. The writer reads nothing of the
// other process but that number, which it checks: it never decreases and is never higher than that
// of the last record. Neither end waits for the other.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <span>

#include "gateway/exchange/cell.h"
#include "gateway/exchange/shared_memory.h"

namespace linegate::exchange {

inline constexpr std::size_t kSharedSeries = 2;

// What both ends know of the memory.
class SlotPlaces {
 public:
  // Records of a series that the memory holds, the one that was carried out last included.
  static constexpr std::uint64_t kSlots = 8;

  using Sizes = std::array<std::size_t, kSharedSeries>;  // of the longest record of each series

 protected:
  struct Head {
    struct Series {
      alignas(kCacheLine) std::atomic<std::uint64_t> last;  // number of the last record
      std::atomic<std::uint64_t> kept;  // as SlotWriter::carried_out(): all from it are intact
      std::uint64_t stride;             // of its slots
    };
    std::array<Series, kSharedSeries> series;
  };
  struct Report {
    alignas(kCacheLine) std::atomic<std::uint64_t> done;  // number of the last record carried out
  };
  using Reports = std::array<Report, kSharedSeries>;
  static constexpr std::size_t kHeadBytes = 4'096;
  static constexpr std::size_t kReportBytes = 4'096;
  static constexpr std::size_t kLengthBytes = 8;

  SlotPlaces(std::byte* records, std::byte* reports) : records_(records), reports_(reports) {}
  Head& head() const { return *reinterpret_cast<Head*>(records_); }
  Report& report(std::size_t series) const {
    return reinterpret_cast<Reports*>(reports_)->at(series);
  }
  std::byte* slot(std::size_t series, std::uint64_t number) const {
    return records_ + first_.at(series) + number % kSlots * stride_.at(series);
  }
  // Returns the size of the memory.
  std::size_t place(const Sizes& strides);

  std::byte* records_;
  std::byte* reports_;
  Sizes stride_{};
  Sizes first_{};
};

class SlotWriter : private SlotPlaces {
 public:
  using SlotPlaces::kSlots;
  using SlotPlaces::Sizes;

  // Throws std::system_error, also if the system cannot protect the records.
  explicit SlotWriter(const Sizes& longest);

  // For the other process.
  std::array<int, 2> descriptors() const {
    return {records_memory_.descriptor(), reports_memory_.descriptor()};
  }

  // --- the thread that writes
  // ---------------------------------------------------------------------

  // Where to write the next record; empty if there is no room.
  std::span<std::byte> draft(std::size_t series);
  // The draft has that length: it is the next record. Returns its number: 1, 2, 3, ...
  std::uint64_t publish(std::size_t series, std::size_t length);

  // --- any thread
  // -----------------------------------------------------------------------------------

  // The other process has reported an impossible number since the last call of forget_damage().
  bool damaged() const { return damaged_.raised(); }
  // Another process takes over from one that has ended. It must not be blamed for what that one
  // did.
  void forget_damage();
  // Number of all records.
  std::uint64_t published() const { return published_.value(); }

 private:
  std::uint64_t carried_out(std::size_t series);

  SharedMemory records_memory_;
  SharedMemory reports_memory_;
  std::array<std::uint64_t, kSharedSeries> last_{};
  std::array<std::uint64_t, kSharedSeries> done_{};  // the last valid report
  Flag damaged_;
  Counter published_;
};

class SlotReader : private SlotPlaces {
 public:
  // With the descriptors of the writer, which may be closed afterwards. Throws std::system_error,
  // also if they are others. Begins with the record that was carried out last.
  explicit SlotReader(const std::array<int, 2>& descriptors);

  // All in one thread.

  // Whether any series has a record to carry out.
  bool any() const;
  struct Record {
    std::uint64_t number = 0;         // 0: there is none
    std::span<const std::byte> data;  // until done()
  };
  Record next(std::size_t series) const;
  // That record was carried out.
  void done(std::size_t series);

 private:
  SharedMemory records_memory_;
  SharedMemory reports_memory_;
  std::array<std::uint64_t, kSharedSeries> next_{};
};

}  // namespace linegate::exchange
