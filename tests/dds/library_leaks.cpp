// SPDX-License-Identifier: Apache-2.0
// Leaks that the address sanitizer reports for Fast DDS: 2.9 does not free the certificates of a
// handshake that it refuses, which test_dds_identities causes. No other program disregards them.

extern "C" const char* __lsan_default_suppressions();

const char* __lsan_default_suppressions() {
  return "leak:libcrypto.so\n";
}
