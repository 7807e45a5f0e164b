// SPDX-License-Identifier: Apache-2.0
// Whether these tests, and dds_peer with them, are built with a sanitizer that keeps freed memory
// or adds to used memory: memory limits are then higher. No other expectation may depend on it.
#pragma once

namespace linegate::test {

#if defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define LINEGATE_TESTS_ARE_SANITIZED
#endif
#endif
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define LINEGATE_TESTS_ARE_SANITIZED
#endif

#ifdef LINEGATE_TESTS_ARE_SANITIZED
inline constexpr bool kIsSanitized = true;
#else
inline constexpr bool kIsSanitized = false;
#endif

}  // namespace linegate::test
