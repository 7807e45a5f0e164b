// SPDX-License-Identifier: Apache-2.0
#include "bridges/dds/guard/key_warnings.h"

#include <string>

#include <fastdds/dds/log/Log.hpp>

#include "bridges/dds/guard/imports.h"

namespace linegate::dds::guard {
namespace {

using eprosima::fastdds::dds::Log;

// void Log::QueueLog(const std::string&, const Log::Context&, Log::Kind)
constexpr const char* kQueueLog =
    "_ZN8eprosima7fastdds3dds3Log8QueueLogERKNSt7__cxx1112basic_stringIcSt11char_traitsIcESaIcEEE"
    "RKNS2_7ContextENS2_4KindE";

// The import of this file is not replaced.
void queue_log(const std::string& message, const Log::Context& context, Log::Kind kind) {
  if (message != kKeyWarning)
    Log::QueueLog(message, context, kind);
}

}  // namespace

bool leave_out_key_warnings() {
  static const bool replaced =
      replace_import("libfastrtps.so", kQueueLog, reinterpret_cast<void*>(queue_log));
  return replaced;
}

}  // namespace linegate::dds::guard
