// SPDX-License-Identifier: Apache-2.0
// A DataWriter that is replaced by a new one before its sequence numbers become a burden.
//
// A reader of Fast DDS 2.9 that comes late works through every sequence number of a writer since 1:
// 1.4 s of processor time after 10^7 samples. The new writer is created beside the old one, which
// is written until the new one has as many readers; the old one is deleted when every reader has
// what it wrote. Readers see the samples of both in the order of the numbers in the samples, and
// none is missing.
#pragma once

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

  // How long a writer stays that has been replaced.
  enum class Keep : std::uint8_t {
    until_received,  // the newest sample of each instance counts, and the new writer has it
    history,         // for late joiners: until the new writer has as many samples as it may keep
  };

  // renew_after: samples, at least 2. make gives nullptr if the writer could not be created, and is
  // called at once. endpoints and what make refers to must outlive it; its writers end with
  // endpoints, or by remove().
  RenewedWriter(Endpoints& endpoints, std::uint64_t renew_after, Keep keep, Make make)
      : endpoints_(&endpoints), make_(std::move(make)), renew_after_(renew_after), keep_(keep) {
    current_ = make_();
  }

  // To be called before a sample is written, with what carries the newest samples over to a writer
  // that has just taken the place of the old one. Gives the writer for the sample.
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

  // nullptr if it could not be created.
  Writer* writer() const { return current_; }

  // calls wanted(writer) for each writer that may have samples.
  template <class Wanted>
  void each(Wanted wanted) {
    for (Writer* writer : {current_, replaced_}) {
      if (writer != nullptr)
        wanted(writer);
    }
  }

  // Nothing of it remains; next() is not to be called again.
  void remove() {
    drop(replacing_);
    drop(replaced_);
    drop(current_);
  }

 private:
  using Clock = std::chrono::steady_clock;
  // Readers that do not answer hold nothing up for longer.
  static constexpr std::chrono::seconds kPatience{10};

  static int readers_of(Writer* writer) {
    eprosima::fastdds::dds::PublicationMatchedStatus status;
    writer->get_publication_matched_status(status);
    return status.current_count;
  }
  static bool acknowledged(Writer* writer) {
    return writer->wait_for_acknowledgments({0, 0}) == ReturnCode_t::RETCODE_OK;
  }

  // Without a new writer the old one goes on, and the next attempt comes as late as this one.
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
  Writer* current_ = nullptr;    // the one that is written
  Writer* replacing_ = nullptr;  // the next one, which waits for readers
  Writer* replaced_ = nullptr;   // the one before
  Clock::time_point since_{};    // replacing_ was created, or replaced_ was replaced
};

}  // namespace linegate::dds
