// SPDX-License-Identifier: Apache-2.0
// A reader of what strangers send: one of them cannot use up its instances for good.
//
// Fast DDS 2.9 keeps an instance for every key of a living writer, read or not, and rejects the
// samples of others when there are no more. So when that happens a new reader takes the place of
// the old one; who was not heard just then writes again.
#pragma once

#include <cstdint>
#include <string>
#include <utility>

#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>

#include "bridges/dds/endpoints.h"
#include "bridges/dds/waiting.h"

namespace linegate::dds {

template <class PubSubType>
class InboundReader {
 public:
  // Both must outlive it; endpoints tells whether the reader could be created.
  InboundReader(Endpoints& endpoints, Waiting& waiting, std::string topic)
      : endpoints_(endpoints), waiting_(waiting), topic_(std::move(topic)) {
    create();
  }

  // False: there is none. A sample without valid data has a meaning for nobody here.
  bool take(typename PubSubType::type& sample, eprosima::fastdds::dds::SampleInfo& info) {
    return reader_ != nullptr && reader_->take_next_sample(&sample, &info) ==
                                     eprosima::fastrtps::types::ReturnCode_t::RETCODE_OK;
  }

  // The policy in which a writer met since the last call does not fit, hence is not heard; 0: none.
  std::uint32_t misfit() {
    eprosima::fastdds::dds::RequestedIncompatibleQosStatus status;
    if (reader_ == nullptr)
      return 0;
    reader_->get_requested_incompatible_qos_status(status);
    return status.total_count_change == 0 ? 0U : static_cast<std::uint32_t>(status.last_policy_id);
  }

  // To be called now and then, when all that was there has been taken.
  void renew_if_full() {
    if (reader_ != nullptr && !full())
      return;
    if (reader_ != nullptr) {
      waiting_.forget(reader_);
      endpoints_.remove(reader_);
    }
    create();
  }

 private:
  bool full() {
    eprosima::fastdds::dds::SampleRejectedStatus status;
    reader_->get_sample_rejected_status(status);
    return status.total_count_change != 0 &&
           status.last_reason == eprosima::fastdds::dds::REJECTED_BY_INSTANCES_LIMIT;
  }

  void create() {
    reader_ = endpoints_.reader<PubSubType>(topic_);
    if (reader_ != nullptr)
      waiting_.watch(reader_);
  }

  Endpoints& endpoints_;
  Waiting& waiting_;
  std::string topic_;
  eprosima::fastdds::dds::DataReader* reader_ = nullptr;
};

}  // namespace linegate::dds
