// SPDX-License-Identifier: Apache-2.0
// Annotations for the thread sanitizer.
//
// Writers and readers of a process allocate their payloads from shared pools. The last user of a
// payload returns it to the pool, which an atomic counter determines
// (TopicPayloadPool::release_payload). The library is not compiled with the sanitizer, so reading a
// payload in one thread and later writing it in another looks like a race. These functions declare
// the synchronisation that the counter provides; without the sanitizer they do nothing.
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

// A sample was deserialized from the payload.
inline void payload_was_read([[maybe_unused]] void* payload) {
#ifdef LINEGATE_THREAD_SANITIZER
  __tsan_release(payload);
#endif
}

// A sample is about to be serialized into the payload.
inline void payload_is_free([[maybe_unused]] void* payload) {
#ifdef LINEGATE_THREAD_SANITIZER
  __tsan_acquire(payload);
#endif
}

}  // namespace linegate::dds
