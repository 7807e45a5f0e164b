// SPDX-License-Identifier: Apache-2.0
#include "bridges/dds/guard/sent_tokens.h"

#include <algorithm>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <utility>

#include <dlfcn.h>
#include <fastdds/rtps/attributes/WriterAttributes.h>
#include <fastdds/rtps/common/CacheChange.h>
#include <fastdds/rtps/history/IPayloadPool.h>
#include <fastdds/rtps/history/WriterHistory.h>
#include <fastdds/rtps/writer/RTPSWriter.h>
#include <fastdds/rtps/writer/WriterListener.h>

#include "bridges/dds/guard/imports.h"

namespace linegate::dds::guard {
namespace {

namespace rtps = eprosima::fastrtps::rtps;

// bool RTPSParticipantImpl::createWriter(RTPSWriter**, WriterAttributes&,
//     const std::shared_ptr<IPayloadPool>&, WriterHistory*, WriterListener*, const EntityId_t&,
//     bool), whose class has no public header
constexpr const char* kCreateWriter =
    "_ZN8eprosima8fastrtps4rtps19RTPSParticipantImpl12createWriterEPPNS1_10RTPSWriterE"
    "RNS1_16WriterAttributesERKSt10shared_ptrINS1_12IPayloadPoolEEPNS1_13WriterHistoryE"
    "PNS1_14WriterListenerERKNS1_10EntityId_tEb";
using CreateWriter = bool(void* participant, rtps::RTPSWriter** writer,
                          rtps::WriterAttributes& attributes,
                          const std::shared_ptr<rtps::IPayloadPool>& payloads,
                          rtps::WriterHistory* history, rtps::WriterListener* listener,
                          const rtps::EntityId_t& entity, bool built_in);
// CacheChange_t* RTPSWriter::new_change(const std::function<uint32_t()>&, ChangeKind_t,
//     InstanceHandle_t)
constexpr const char* kNewSample =
    "_ZN8eprosima8fastrtps4rtps10RTPSWriter10new_changeERKSt8functionIFjvEE"
    "NS1_12ChangeKind_tENS1_16InstanceHandle_tE";
using NewSample = rtps::CacheChange_t*(rtps::RTPSWriter* writer,
                                       const std::function<std::uint32_t()>& size,
                                       rtps::ChangeKind_t kind, rtps::InstanceHandle_t instance);

struct TokenCalls {
  CreateWriter* create_writer =
      reinterpret_cast<CreateWriter*>(::dlsym(RTLD_DEFAULT, kCreateWriter));
  NewSample* new_sample = reinterpret_cast<NewSample*>(::dlsym(RTLD_DEFAULT, kNewSample));
};

const TokenCalls& token_calls() {
  static const TokenCalls it;
  return it;
}

// BuiltinParticipantVolatileMessageSecureWriter
bool sends_tokens(const rtps::EntityId_t& entity) {
  return entity == rtps::EntityId_t(0xFF0202C3);
}

// The samples of one writer. The library reports acknowledged ones while it holds locks of the
// writer, with which a removal could wait for another thread for ever (its issue 3468), so they are
// removed later.
class SentTokens final : public rtps::WriterListener {
 public:
  explicit SentTokens(rtps::WriterHistory& history) : history_(history) {}

  // With the mutex of the history.
  void onWriterChangeReceivedByAll(rtps::RTPSWriter* /*writer*/,
                                   rtps::CacheChange_t* sample) override {
    acknowledged_ = std::max(acknowledged_, sample->sequenceNumber);
  }
  void drop_acknowledged() {
    const std::lock_guard lock(*history_.getMutex());
    rtps::CacheChange_t* oldest = nullptr;
    while (history_.get_min_change(&oldest) && oldest->sequenceNumber <= acknowledged_) {
      if (!history_.remove_change(oldest->sequenceNumber))
        return;
    }
  }
  std::size_t size() {
    const std::lock_guard lock(*history_.getMutex());
    return history_.getHistorySize();
  }

 private:
  rtps::WriterHistory& history_;
  rtps::SequenceNumber_t acknowledged_;  // the greatest number
};

// By participant. An entry remains after the end of its writer, unused.
struct AllSentTokens {
  std::mutex mutex;
  std::map<rtps::GuidPrefix_t, std::shared_ptr<SentTokens>> of;
};

AllSentTokens& all_sent_tokens() {
  static auto* const it = new AllSentTokens;  // threads of the library may outlive static objects
  return *it;
}

std::shared_ptr<SentTokens> tokens_of(const rtps::GuidPrefix_t& participant) {
  const std::lock_guard lock(all_sent_tokens().mutex);
  const auto found = all_sent_tokens().of.find(participant);
  return found == all_sent_tokens().of.end() ? nullptr : found->second;
}

bool create_writer(void* participant, rtps::RTPSWriter** writer, rtps::WriterAttributes& attributes,
                   const std::shared_ptr<rtps::IPayloadPool>& payloads,
                   rtps::WriterHistory* history, rtps::WriterListener* listener,
                   const rtps::EntityId_t& entity, bool built_in) {
  if (!sends_tokens(entity) || listener != nullptr || history == nullptr) {
    return token_calls().create_writer(participant, writer, attributes, payloads, history, listener,
                                       entity, built_in);
  }
  auto tokens = std::make_shared<SentTokens>(*history);
  const bool created = token_calls().create_writer(participant, writer, attributes, payloads,
                                                   history, tokens.get(), entity, built_in);
  if (created) {
    const std::lock_guard lock(all_sent_tokens().mutex);
    all_sent_tokens().of[(*writer)->getGuid().guidPrefix] = std::move(tokens);
  }
  return created;
}

rtps::CacheChange_t* new_sample(rtps::RTPSWriter* writer,
                                const std::function<std::uint32_t()>& size, rtps::ChangeKind_t kind,
                                rtps::InstanceHandle_t instance) {
  if (sends_tokens(writer->getGuid().entityId)) {
    if (const auto tokens = tokens_of(writer->getGuid().guidPrefix); tokens != nullptr)
      tokens->drop_acknowledged();
  }
  return token_calls().new_sample(writer, size, kind, instance);
}

}  // namespace

bool drop_sent_tokens() {
  static const bool replaced =
      token_calls().create_writer != nullptr && token_calls().new_sample != nullptr &&
      replace_import("libfastrtps.so", kCreateWriter, reinterpret_cast<void*>(create_writer)) &&
      replace_import("libfastrtps.so", kNewSample, reinterpret_cast<void*>(new_sample));
  return replaced;
}

std::size_t kept_tokens(const std::array<std::uint8_t, 12>& prefix) {
  rtps::GuidPrefix_t participant;
  std::copy_n(prefix.begin(), prefix.size(), participant.value);
  const auto tokens = tokens_of(participant);
  return tokens == nullptr ? 0 : tokens->size();
}

}  // namespace linegate::dds::guard
