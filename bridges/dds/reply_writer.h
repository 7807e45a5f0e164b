// SPDX-License-Identifier: Apache-2.0
// Writes CommandReply, which has an instance for each client that ever asked.
//
// Fast DDS 2.9 has no safe way to let go of an instance of a transient-local writer: dispose()
// keeps it, and unregister_instance() may leave a thread of the library in an endless loop
// (StatefulWriter::check_acked_status). So when the instances of the profile are used up, a new
// writer takes the place of the old one; who waits for a reply just then asks again. Replies are
// kept for readers that are about to be matched only, so now and then all are dropped: those of a
// client that was silent since would lie ever further behind the newest (state_writer.h).
#pragma once

#include <cstddef>
#include <cstdint>
#include <mutex>
#include <set>
#include <string>
#include <utility>

#include <fastdds/dds/publisher/DataWriter.hpp>
#include <linegate.h>

#include "bridges/dds/endpoints.h"
#include "stack/base/time.h"

namespace linegate::dds {

class ReplyWriter {
 public:
  // endpoints must outlive it, and reports whether the writer could be created.
  // renew_after: replies, after which a new writer takes the place of the old one when every reader
  // has all of them (renewed_writer.h says why).
  ReplyWriter(Endpoints& endpoints, std::uint64_t renew_after);

  // From any thread. False: DDS did not take it.
  bool write(v1::CommandReply& sample);
  // Until every reader has all that was written, or the time is over.
  void wait_for_acknowledgments(Duration most);

 private:
  void make_room_for(const v1::CommandReply& sample);
  void drop_old();
  bool all_received();

  Endpoints& endpoints_;
  const std::uint64_t renew_after_;
  std::mutex mutex_;
  eprosima::fastdds::dds::DataWriter* writer_;  // nullptr: to be created with the next reply
  std::set<std::pair<std::string, std::string>> instances_;  // line and client, of this writer
  std::uint64_t written_ = 0;                                // by this writer
  std::size_t kept_ = 0;  // at most: written since all were dropped
};

}  // namespace linegate::dds
