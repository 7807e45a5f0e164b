// SPDX-License-Identifier: Apache-2.0
#include "gateway/publish/dds_process_main.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <ctime>
#include <exception>
#include <memory>
#include <span>
#include <string>

#include <sys/prctl.h>
#include <unistd.h>

#include "bridges/dds/library_log.h"
#include "bridges/dds/security.h"
#include "gateway/edge/edge_end.h"
#include "gateway/edge/file_access.h"
#include "gateway/runtime/exit_code.h"
#include "gateway/security/fingerprint.h"
#include "gateway/security/peer_certificates.h"

namespace linegate::gateway {
namespace {

constexpr std::size_t kMemory = std::size_t{2} << 30U;

}  // namespace

// A single write, so that lines of several threads are not mixed.
void write_line(Severity severity, std::string_view text) {
  std::string line = severity == Severity::error ? "<3>" : "<4>";
  line += text;
  std::replace(line.begin(), line.end(), '\n', ' ');
  line += '\n';
  if (write(STDERR_FILENO, line.data(), line.size()) < 0) {
    return;  // the log is lost, and nothing else
  }
}

bool enter_dds_process() {
  if (!give_up_privileges(kMemory)) {
    write_line(Severity::error, "the DDS process cannot give up its privileges");
    return false;
  }
  // Fast DDS writes the segments of its shared memory transport, and no other file.
  switch (restrict_writing({"/dev/shm"})) {
    case WriteLimit::set:
      break;
    case WriteLimit::unavailable:
      write_line(Severity::warning, kWritesNotLimited);
      break;
    case WriteLimit::refused:
      write_line(Severity::error, "the access of the DDS process to files cannot be limited");
      return false;
  }
  dds::set_library_log(write_line);
  return true;
}

void add_security_functions(dds::Security& to) {
  if (!to.enabled()) {
    return;
  }
  const auto peers = std::make_shared<security::PeerCertificates>(to.ca);
  to.accepts_certificate = [peers](std::span<const std::uint8_t> pem) {
    return peers->note(pem, std::time(nullptr));
  };
  to.next_expiry = [peers] { return std::int64_t{peers->next_expiry()}; };
  to.is_holder = security::is_holder;
}

// Neither destructors of static objects nor threads of the library may delay the end.
void run_process(const char* name, int (*run)()) {
  prctl(PR_SET_NAME, name, 0, 0, 0);
  int result = kExitFailed;
  try {
    result = run();
  } catch (const std::exception& error) {
    write_line(Severity::error, error.what());
  }
  _exit(result);
}

}  // namespace linegate::gateway
