// SPDX-License-Identifier: Apache-2.0
// What the thread sanitizer cannot see of Fast DDS.
//
// Writers and readers of a process take the memory of their samples from common pools. Who lets go
// of a payload last gives it back, which the library finds out by an atomic counter
// (TopicPayloadPool::release_payload). It is not compiled with the sanitizer, so that a payload
// that was read in one thread and is then written in another looks like a race. These say what the
// counter does; without the sanitizer they are nothing.
#pragma once

#if defined(__has_feature)
#if __has_feature(thread_sanitizer)
#define LINEGATE_THREAD_SANITIZER
#endif
#elif defined(__SANITIZE_THREAD__)
#define LINEGATE_THREAD_SANITIZER
#endif

#ifdef LINEGATE_THREAD_SANITIZER
#include <sanitizer/tsan_interface.h>
#endif

namespace linegate::dds {

// A sample has been read from it.
inline void payload_was_read([[maybe_unused]] void* payload) {
#ifdef LINEGATE_THREAD_SANITIZER
  __tsan_release(payload);
#endif
}

// A sample is going to be written into it.
inline void payload_is_free([[maybe_unused]] void* payload) {
#ifdef LINEGATE_THREAD_SANITIZER
  __tsan_acquire(payload);
#endif
}

}  // namespace linegate::dds
