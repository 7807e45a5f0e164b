// SPDX-License-Identifier: Apache-2.0
#include "bridges/dds/guard/instance_states.h"

#include <cstdint>
#include <limits>

#include <dlfcn.h>
#include <fastdds/rtps/attributes/EndpointAttributes.h>
#include <fastdds/rtps/common/CacheChange.h>
#include <fastdds/rtps/common/InstanceHandle.h>
#include <fastdds/rtps/history/ReaderHistory.h>
#include <fastdds/rtps/reader/RTPSReader.h>

#include "bridges/dds/guard/imports.h"

namespace linegate::dds::guard {
namespace {

namespace rtps = eprosima::fastrtps::rtps;

// Of eprosima::fastdds::dds::detail::DataReaderHistory, which has no public header:
// bool update_instance_nts(CacheChange_t*), bool is_instance_present(const InstanceHandle_t&) const
constexpr const char* kUpdateInstance =
    "_ZN8eprosima7fastdds3dds6detail17DataReaderHistory19update_instance_nts"
    "EPNS_8fastrtps4rtps13CacheChange_tE";
constexpr const char* kIsPresent =
    "_ZNK8eprosima7fastdds3dds6detail17DataReaderHistory19is_instance_present"
    "ERKNS_8fastrtps4rtps16InstanceHandle_tE";
// void instance_viewed_nts(const std::shared_ptr<DataReaderInstance>&)
constexpr const char* kViewInstance =
    "_ZN8eprosima7fastdds3dds6detail17DataReaderHistory19instance_viewed_nts"
    "ERKSt10shared_ptrINS2_18DataReaderInstanceEE";
using UpdateInstance = bool(rtps::ReaderHistory* history, rtps::CacheChange_t* sample);
using IsPresent = bool(const rtps::ReaderHistory* history, const rtps::InstanceHandle_t& instance);

struct InstanceCalls {
  UpdateInstance* update =
      reinterpret_cast<UpdateInstance*>(::dlsym(RTLD_DEFAULT, kUpdateInstance));
  IsPresent* is_present = reinterpret_cast<IsPresent*>(::dlsym(RTLD_DEFAULT, kIsPresent));
};

const InstanceCalls& instance_calls() {
  static const InstanceCalls it;
  return it;
}

struct HistoryAccess : rtps::ReaderHistory {
  static const rtps::EndpointAttributes& attributes(rtps::ReaderHistory& history) {
    constexpr auto kReader = &HistoryAccess::mp_reader;
    return (history.*kReader)->getAttributes();
  }
};

// Called with the mutex of the reader. Where it returns false, the library removes the sample and
// reports it to nobody, as that of a writer that does not own the instance.
bool update_instance(rtps::ReaderHistory* history, rtps::CacheChange_t* sample) {
  const rtps::EndpointAttributes& reader = HistoryAccess::attributes(*history);
  if (reader.topicKind == rtps::WITH_KEY &&
      !instance_calls().is_present(history, sample->instanceHandle))
    return false;
  if (reader.ownershipKind == eprosima::fastdds::dds::EXCLUSIVE_OWNERSHIP_QOS) {
    if (sample->kind != rtps::ALIVE)
      return false;
    std::uint32_t& strength = sample->reader_info.writer_ownership_strength;
    if (strength == std::numeric_limits<std::uint32_t>::max())
      --strength;
  }
  if (sample->kind != rtps::NOT_ALIVE_DISPOSED)
    return instance_calls().update(history, sample);
  sample->kind = rtps::NOT_ALIVE_DISPOSED_UNREGISTERED;
  const bool reported = instance_calls().update(history, sample);
  sample->kind = rtps::NOT_ALIVE_DISPOSED;
  return reported;
}

// Called after samples of the instance were taken. It would set the view state to NOT_NEW, which
// Linegate's programs do not use.
void view_instance(rtps::ReaderHistory* /*history*/, const void* /*instance*/) {
}

}  // namespace

bool watch_instance_states() {
  static const bool replaced =
      instance_calls().update != nullptr && instance_calls().is_present != nullptr &&
      replace_import("libfastrtps.so", kUpdateInstance, reinterpret_cast<void*>(update_instance)) &&
      replace_import("libfastrtps.so", kViewInstance, reinterpret_cast<void*>(view_instance));
  return replaced;
}

}  // namespace linegate::dds::guard
