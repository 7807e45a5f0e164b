// SPDX-License-Identifier: Apache-2.0
// Preloaded into the DDS process (LD_PRELOAD): faults of Fast DDS at the request of a signal.
//   SIGUSR1     the thread that receives the next datagram loops in the library without end
//   SIGUSR2     a thread allocates and fills memory without end
//   SIGRTMIN    the thread that the signal interrupts loops without end, with the locks that it has
//   SIGRTMIN+1  the thread that runs the timers loops without end in the next one
//   SIGRTMIN+2  all that the process reports of the images it has published is overwritten
#include <array>
#include <atomic>
#include <chrono>
#include <csignal>
#include <cstddef>
#include <cstring>
#include <thread>

#include <dlfcn.h>
#include <fastdds/rtps/common/CDRMessage_t.h>
#include <fastdds/rtps/common/Locator.h>
#include <semaphore.h>
#include <sys/mman.h>

namespace {

volatile std::sig_atomic_t receiver_loops = 0;
volatile std::sig_atomic_t timer_loops = 0;
volatile std::sig_atomic_t work = 0;
sem_t hog;

// The memory of the reports, one for each line: a page that another process reads.
constexpr std::size_t kReportBytes = 4096;
std::array<std::atomic<void*>, 16> reports;
std::atomic<std::size_t> report_count = 0;

void overwrite_reports() {
  for (std::atomic<void*>& report : reports) {
    if (void* const memory = report; memory != nullptr) {
      std::memset(memory, 0xFF, kReportBytes);
    }
  }
}

[[noreturn]] void loop() {
  while (true) {
    work = work + 1;
  }
}

void allocate_without_end() {
  constexpr std::size_t kBlock = std::size_t{1} << 20U;
  while (sem_wait(&hog) != 0) {
  }
  while (true) {
    auto* const block = new std::byte[kBlock];
    std::memset(block, 0x5A, kBlock);
  }
}

void on(int signal, void (*handler)(int)) {
  struct sigaction action {};
  action.sa_handler = handler;
  sigaction(signal, &action, nullptr);
}

[[gnu::constructor]] void install() {
  sem_init(&hog, 0, 0);
  std::thread(allocate_without_end).detach();
  on(SIGUSR1, [](int) { receiver_loops = 1; });
  on(SIGUSR2, [](int) { sem_post(&hog); });
  on(SIGRTMIN, [](int) { loop(); });
  on(SIGRTMIN + 1, [](int) { timer_loops = 1; });
  on(SIGRTMIN + 2, [](int) { overwrite_reports(); });
}

}  // namespace

// Replaces the function of the C library, and calls it.
extern "C" void* mmap(void* address, std::size_t bytes, int protection, int flags, int file,
                      off_t offset) noexcept {
  using Function = void* (*)(void*, std::size_t, int, int, int, off_t);
  static const auto library = reinterpret_cast<Function>(dlsym(RTLD_NEXT, "mmap"));
  void* const memory = library(address, bytes, protection, flags, file, offset);
  if (bytes == kReportBytes && (flags & MAP_SHARED) != 0 && (protection & PROT_WRITE) != 0 &&
      memory != MAP_FAILED && report_count < reports.size()) {
    reports[report_count++] = memory;
  }
  return memory;
}

// Replace the functions of the library that read each datagram and run each timer, and call them.
namespace eprosima::fastrtps::rtps {

class MessageReceiver {
 public:
  void processCDRMsg(const Locator_t& from, const Locator_t& to, CDRMessage_t* message);
};

void MessageReceiver::processCDRMsg(const Locator_t& from, const Locator_t& to,
                                    CDRMessage_t* message) {
  if (receiver_loops != 0) {
    loop();
  }
  using Function = void (*)(MessageReceiver*, const Locator_t&, const Locator_t&, CDRMessage_t*);
  static const auto library = reinterpret_cast<Function>(
      dlsym(RTLD_NEXT,
            "_ZN8eprosima8fastrtps4rtps15MessageReceiver13processCDRMsgERKNS1_9Locator_tES5_PNS1_"
            "12CDRMessage_tE"));
  library(this, from, to, message);
}

class TimedEventImpl {
 public:
  using Time = std::chrono::steady_clock::time_point;
  void trigger(Time now, Time cancelled);
};

void TimedEventImpl::trigger(Time now, Time cancelled) {
  if (timer_loops != 0) {
    loop();
  }
  using Function = void (*)(TimedEventImpl*, Time, Time);
  static const auto library = reinterpret_cast<Function>(
      dlsym(RTLD_NEXT,
            "_ZN8eprosima8fastrtps4rtps14TimedEventImpl7triggerENSt6chrono10time_pointINS3_3_"
            "V212steady_clockENS3_8durationIlSt5ratioILl1ELl1000000000EEEEEESB_"));
  library(this, now, cancelled);
}

}  // namespace eprosima::fastrtps::rtps
