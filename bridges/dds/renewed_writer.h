// SPDX-License-Identifier: Apache-2.0
// A DataWriter that is replaced by a new one before its sequence numbers become too high.
//
// A late joining reader of Fast DDS 2.9 processes every sequence number of a writer from 1: 1.4 s
// of processor time after 10^7 samples. The new writer is created beside the old one, which is
// written until the new one has as many readers. The old one is deleted when every reader has
// received its samples. Readers receive all samples of both, in the order of the numbers in the
// samples.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <functional>
#include <utility>

#include <fastdds/dds/publisher/DataWriter.hpp>

#include "bridges/dds/endpoints.h"

namespace linegate::dds {

class RenewedWriter {
 public:
  using Writer = eprosima::fastdds::dds::DataWriter;
  using Make = std::function<Writer*()>;

  // How long a replaced writer is kept.
  enum class Keep : std::uint8_t {
    until_received,  // only the newest sample of each instance counts, and the new writer has it
    history,         // for late joiners: until the new writer has filled its history depth
  };

  // renew_after: samples, at least 2. make returns nullptr if the writer could not be created; the
  // constructor calls it. endpoints and all references in make must outlive this object. The
  // writers are deleted by endpoints or by remove().
  RenewedWriter(Endpoints& endpoints, std::uint64_t renew_after, Keep keep, Make make)
      : endpoints_(&endpoints), make_(std::move(make)), renew_after_(renew_after), keep_(keep) {
    current_ = make_();
  }

  // Call it before each sample, with a function that writes the newest samples to a writer that has
  // just replaced the old one. Returns the writer for the sample.
  template <class CarryOver>
  Writer* next(CarryOver carry_over) {
    if (++written_ >= renew_after_ && replacing_ == nullptr && replaced_ == nullptr)
      begin();
    if (replacing_ != nullptr && replacing_is_ready()) {
      replaced_ = std::exchange(current_, std::exchange(replacing_, nullptr));
      written_ = 1;
      since_ = Clock::now();
      carry_over(current_);
    }
    if (replaced_ != nullptr && replaced_is_done())
      drop(replaced_);
    return current_;
  }
  Writer* next() {
    return next([](Writer*) {});
  }

  // Begins to replace the writer with the next sample, unless it is being replaced.
  void renew() { written_ = std::max(written_, renew_after_); }

  // nullptr if it could not be created.
  Writer* writer() const { return current_; }

  // Calls wanted(writer) for each writer that may have samples.
  template <class Wanted>
  void each(Wanted wanted) {
    for (Writer* writer : {current_, replaced_}) {
      if (writer != nullptr)
        wanted(writer);
    }
  }

  // Deletes all writers. next() must not be called afterwards.
  void remove() {
    drop(replacing_);
    drop(replaced_);
    drop(current_);
  }

 private:
  using Clock = std::chrono::steady_clock;
  // Longest wait for readers that do not respond.
  static constexpr std::chrono::seconds kPatience{10};

  static int readers_of(Writer* writer) {
    eprosima::fastdds::dds::PublicationMatchedStatus status;
    writer->get_publication_matched_status(status);
    return status.current_count;
  }
  static bool acknowledged(Writer* writer) {
    return writer->wait_for_acknowledgments({0, 0}) == ReturnCode_t::RETCODE_OK;
  }

  // If no writer can be created, the old one continues, and the next attempt follows after
  // renew_after samples.
  void begin() {
    replacing_ = make_();
    since_ = Clock::now();
    written_ = replacing_ == nullptr ? 0 : written_;
  }
  bool replacing_is_ready() {
    return readers_of(replacing_) >= readers_of(current_) || Clock::now() - since_ > kPatience;
  }
  bool replaced_is_done() {
    if (keep_ == Keep::history)
      return written_ > static_cast<std::uint64_t>(current_->get_qos().history().depth);
    return (acknowledged(replaced_) && acknowledged(current_)) || Clock::now() - since_ > kPatience;
  }
  void drop(Writer*& writer) {
    if (writer != nullptr)
      endpoints_->remove(std::exchange(writer, nullptr));
  }

  Endpoints* endpoints_;
  Make make_;
  std::uint64_t renew_after_;
  Keep keep_;
  std::uint64_t written_ = 0;    // by current_
  Writer* current_ = nullptr;    // the writer in use
  Writer* replacing_ = nullptr;  // its successor, while it waits for readers
  Writer* replaced_ = nullptr;   // its predecessor
  Clock::time_point since_{};    // when replacing_ was created, or replaced_ was replaced
};

}  // namespace linegate::dds
