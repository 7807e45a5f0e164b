#include "bridges/dds/reply_writer.h"

#include <linegatePubSubTypes.h>

#include "bridges/dds/waiting.h"

namespace linegate::dds {
namespace {

constexpr std::size_t kManyReplies = 1'024;   // dropped when every reader has them
constexpr std::size_t kMostReplies = 16'384;  // dropped even if not

}  // namespace

ReplyWriter::ReplyWriter(Endpoints& endpoints)
    : endpoints_(endpoints),
      writer_(endpoints.writer<v1::CommandReplyPubSubType>(v1::TOPIC_COMMAND_REPLY)) {
}

bool ReplyWriter::write(v1::CommandReply& sample) {
  const std::lock_guard lock(mutex_);
  make_room_for(sample);
  drop_old();
  return writer_ != nullptr && writer_->write(&sample);
}

void ReplyWriter::wait_for_acknowledgments(Duration most) {
  const std::lock_guard lock(mutex_);
  if (writer_ != nullptr)
    writer_->wait_for_acknowledgments(to_dds(most));
}

void ReplyWriter::make_room_for(const v1::CommandReply& sample) {
  std::pair instance(sample.line().to_string(), sample.client().to_string());
  if (writer_ != nullptr) {
    instances_.insert(instance);
    const int most = writer_->get_qos().resource_limits().max_instances;
    if (most <= 0 || instances_.size() <= static_cast<std::size_t>(most))
      return;
    endpoints_.remove(writer_);
  }
  writer_ = endpoints_.writer<v1::CommandReplyPubSubType>(v1::TOPIC_COMMAND_REPLY);
  instances_ = {std::move(instance)};
  kept_ = 0;
}

void ReplyWriter::drop_old() {
  if (writer_ == nullptr || ++kept_ <= kManyReplies)
    return;
  const bool all_have_them = writer_->wait_for_acknowledgments({0, 0}) == ReturnCode_t::RETCODE_OK;
  if (!all_have_them && kept_ <= kMostReplies)
    return;
  std::size_t dropped = 0;
  writer_->clear_history(&dropped);
  kept_ = 1;
}

}  // namespace linegate::dds
