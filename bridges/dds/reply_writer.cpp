// SPDX-License-Identifier: Apache-2.0
#include "bridges/dds/reply_writer.h"

#include <linegatePubSubTypes.h>

#include "bridges/dds/waiting.h"

namespace linegate::dds {
namespace {

constexpr std::size_t kManyReplies = 1'024;   // dropped when every reader has them
constexpr std::size_t kMostReplies = 16'384;  // dropped even if not

}  // namespace

ReplyWriter::ReplyWriter(Endpoints& endpoints, std::uint64_t renew_after, std::string partition)
    : endpoints_(endpoints),
      renew_after_(renew_after),
      partition_(std::move(partition)),
      writer_(create()) {
}

eprosima::fastdds::dds::DataWriter* ReplyWriter::create() {
  using Type = v1::CommandReplyPubSubType;
  return partition_.empty() ? endpoints_.writer<Type>(v1::TOPIC_COMMAND_REPLY)
                            : endpoints_.writer_in<Type>(partition_, v1::TOPIC_COMMAND_REPLY);
}

bool ReplyWriter::write(v1::CommandReply& sample) {
  const std::lock_guard lock(mutex_);
  make_room_for(sample);
  drop_old();
  ++written_;
  return writer_ != nullptr && writer_->write(&sample);
}

void ReplyWriter::wait_for_acknowledgments(Duration most) {
  const std::lock_guard lock(mutex_);
  if (writer_ != nullptr)
    writer_->wait_for_acknowledgments(to_dds(most));
}

bool ReplyWriter::has_readers() const {
  const std::lock_guard lock(mutex_);
  eprosima::fastdds::dds::PublicationMatchedStatus status;
  return writer_ != nullptr &&
         writer_->get_publication_matched_status(status) == ReturnCode_t::RETCODE_OK &&
         status.current_count > 0;
}

void ReplyWriter::remove() {
  const std::lock_guard lock(mutex_);
  if (writer_ != nullptr)
    endpoints_.remove(writer_);
  writer_ = nullptr;
}

void ReplyWriter::make_room_for(const v1::CommandReply& sample) {
  std::pair instance(sample.line().to_string(), sample.client().to_string());
  if (writer_ != nullptr) {
    instances_.insert(instance);
    const int most = writer_->get_qos().resource_limits().max_instances;
    const bool full = most > 0 && instances_.size() > static_cast<std::size_t>(most);
    const bool old = written_ >= renew_after_ && all_received();
    if (!full && !old)
      return;
    endpoints_.remove(writer_);
  }
  writer_ = create();
  instances_ = {std::move(instance)};
  written_ = 0;
  kept_ = 0;
}

bool ReplyWriter::all_received() {
  return writer_->wait_for_acknowledgments({0, 0}) == ReturnCode_t::RETCODE_OK;
}

void ReplyWriter::drop_old() {
  if (writer_ == nullptr || ++kept_ <= kManyReplies)
    return;
  if (!all_received() && kept_ <= kMostReplies)
    return;
  std::size_t dropped = 0;
  writer_->clear_history(&dropped);
  kept_ = 1;
}

}  // namespace linegate::dds
