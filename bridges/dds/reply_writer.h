// SPDX-License-Identifier: Apache-2.0
// Writes CommandReply, which has an instance for each client that ever sent a request.
//
// Fast DDS 2.9 cannot safely remove an instance of a transient-local writer: dispose() keeps it,
// and unregister_instance() may leave a thread of the library in an endless loop
// (StatefulWriter::check_acked_status). So a new writer replaces the old one when the instances of
// the profile are used up; clients that wait for a reply then repeat their requests. Replies are
// kept only for readers that are about to be matched, so all are dropped periodically: otherwise
// the replies of silent clients would fall further and further behind the newest ones
// (state_writer.h).
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
  // renew_after: number of replies after which a new writer replaces the old one, once every reader
  // has received all of them (renewed_writer.h describes the reason).
  // partition: empty for the default one. The topic must exist.
  ReplyWriter(Endpoints& endpoints, std::uint64_t renew_after, std::string partition = {});

  // From any thread. Returns false if DDS refused the sample.
  bool write(v1::CommandReply& sample);
  // Waits until every reader has acknowledged all replies, at most `most`.
  void wait_for_acknowledgments(Duration most);
  bool has_readers() const;
  // Deletes the DDS writer; only the destructor may follow.
  void remove();

 private:
  eprosima::fastdds::dds::DataWriter* create();
  void make_room_for(const v1::CommandReply& sample);
  void drop_old();
  bool all_received();

  Endpoints& endpoints_;
  const std::uint64_t renew_after_;
  const std::string partition_;
  mutable std::mutex mutex_;
  eprosima::fastdds::dds::DataWriter* writer_;               // nullptr: the next reply creates it
  std::set<std::pair<std::string, std::string>> instances_;  // line and client, of this writer
  std::uint64_t written_ = 0;                                // by this writer
  std::size_t kept_ = 0;  // upper bound: number of replies written since all were dropped
};

}  // namespace linegate::dds
