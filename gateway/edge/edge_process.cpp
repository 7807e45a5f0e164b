// SPDX-License-Identifier: Apache-2.0
#include "gateway/edge/edge_process.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <exception>
#include <optional>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <pthread.h>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include "gateway/edge/edge_end.h"
#include "gateway/edge/memory_size.h"
#include "gateway/runtime/clock.h"
#include "stack/base/assert.h"

namespace linegate::gateway {
namespace {

constexpr Duration kLookPeriod = std::chrono::milliseconds(100);
constexpr std::size_t kLongestLine = 2'000;
constexpr int kReadsPerLook = 16;
// Wake-ups without a message between two messages. A process that works causes one at most: it
// signals once for each call of prepare_wait(), after the message.
constexpr int kMostEmptyWakes = 100;

// Closes it at its end.
class Descriptor {
 public:
  explicit Descriptor(int number = -1) : number_(number) {}
  Descriptor(Descriptor&& other) noexcept : number_(std::exchange(other.number_, -1)) {}
  Descriptor& operator=(Descriptor&& other) noexcept {
    std::swap(number_, other.number_);
    return *this;
  }
  ~Descriptor() {
    if (number_ >= 0) {
      close(number_);
    }
  }
  int get() const { return number_; }

 private:
  int number_;
};

using DescriptorPair = std::pair<Descriptor, Descriptor>;

DescriptorPair checked(int result, const std::array<int, 2>& both, const char* what) {
  if (result != 0) {
    throw std::system_error(errno, std::generic_category(), what);
  }
  return {Descriptor(both[0]), Descriptor(both[1])};
}

DescriptorPair make_sockets() {
  std::array<int, 2> both{};
  const int result = socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, both.data());
  return checked(result, both, "socketpair");
}

DescriptorPair make_pipe() {
  std::array<int, 2> both{};
  const int result = pipe2(both.data(), O_CLOEXEC);
  return checked(result, both, "pipe");
}

// Its numbers are above those of the process that is started, so that none is overwritten before it
// is duplicated.
Descriptor moved_up(Descriptor from) {
  Descriptor out(fcntl(from.get(), F_DUPFD_CLOEXEC, 16));
  return out;
}

std::string describe_end(const siginfo_t& end) {
  if (end.si_code == CLD_EXITED && end.si_status == kExitOutOfMemory) {
    return "ended because it had used up its memory";
  }
  if (end.si_code == CLD_EXITED) {
    return fmt::format("ended with exit code {}", end.si_status);
  }
  return fmt::format("was ended by signal {} ({})", end.si_status, strsignal(end.si_status));
}

// Without NOTIFY_SOCKET and WATCHDOG_...: only this process reports to the service manager.
std::vector<char*> environment_of_child() {
  std::vector<char*> out;
  for (char** entry = environ; *entry != nullptr; ++entry) {
    const std::string_view text = *entry;
    if (!text.starts_with("NOTIFY_SOCKET=") && !text.starts_with("WATCHDOG_")) {
      out.push_back(*entry);
    }
  }
  out.push_back(nullptr);
  return out;
}

// Returns its process ID, or -1 with errno.
pid_t spawn(const std::string& program, const std::vector<std::string>& command, int rings,
            int socket, int bell, int output) {
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_adddup2(&actions, output, STDOUT_FILENO);
  posix_spawn_file_actions_adddup2(&actions, output, STDERR_FILENO);
  posix_spawn_file_actions_adddup2(&actions, rings, kRingsDescriptor);
  posix_spawn_file_actions_adddup2(&actions, socket, kWakeDescriptor);
  posix_spawn_file_actions_adddup2(&actions, bell, kBellDescriptor);
  posix_spawn_file_actions_addclosefrom_np(&actions, kBellDescriptor + 1);
  // Signals to the service or the terminal are for this process, which then ends the other one.
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  sigset_t blocked;
  sigemptyset(&blocked);
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    sigaddset(&blocked, signal);
  }
  posix_spawnattr_setsigmask(&attributes, &blocked);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK);
  std::vector<char*> arguments;
  arguments.reserve(command.size() + 1);
  for (const std::string& argument : command) {
    arguments.push_back(const_cast<char*>(argument.c_str()));
  }
  arguments.push_back(nullptr);
  pid_t pid = -1;
  const int error = posix_spawn(&pid, program.c_str(), &actions, &attributes, arguments.data(),
                                environment_of_child().data());
  posix_spawn_file_actions_destroy(&actions);
  posix_spawnattr_destroy(&attributes);
  errno = error;
  return error == 0 ? pid : -1;
}

}  // namespace

Duration RestartPauses::after(Duration ran) {
  if (ran >= stable_) {
    next_ = {};
  }
  const Duration pause = next_;
  next_ = pause == Duration::zero() ? kFirst : std::min(2 * pause, kLongest);
  return pause;
}

void ProgressLimit::begin(Instant start) {
  if (has_started()) {
    to_start_ = kToStart;
  } else if (std::ranges::any_of(seen_,
                                 [&](const Seen& seen) { return seen.unchanged >= to_start_; })) {
    to_start_ = std::min(2 * to_start_, kLongestToStart);
  }
  seen_.clear();
  asked_ = start;
}

bool ProgressLimit::has_started() const {
  return !seen_.empty() &&
         std::ranges::all_of(seen_, [](const Seen& seen) { return seen.value != 0; });
}

void ProgressLimit::note_interval(Duration interval) {
  constexpr int kDecay = 64;  // it is halved in a few seconds
  longest_interval_ = std::max(interval, longest_interval_ - longest_interval_ / kDecay);
}

bool ProgressLimit::look(std::span<const std::uint64_t> counters, Instant now) {
  const Duration since = now - std::exchange(asked_, now);
  LINEGATE_ASSERT(since >= Duration::zero(), "the calls are in the order of time");
  seen_.resize(counters.size());
  const Duration to_continue =
      std::clamp<Duration>(kMargin * longest_interval_, kToContinue, kLongestToContinue);
  bool good = true;
  for (std::size_t i = 0; i < counters.size(); ++i) {
    Seen& seen = seen_[i];
    const std::uint64_t before = std::exchange(seen.value, counters[i]);
    seen.unchanged += std::min(since, kOwnDelay);
    if (before != counters[i]) {
      if (before != 0) {
        note_interval(seen.unchanged);
      }
      seen.unchanged = {};
    }
    good = good && seen.unchanged < (counters[i] == 0 ? to_start_ : to_continue);
  }
  return good;
}

// One start of the process.
struct EdgeProcess::Child {
  explicit Child(std::uint64_t start_number, Instant start)
      : number(start_number), started(start) {}

  const std::uint64_t number;
  exchange::SharedRings rings;
  exchange::ByteRingProducer outgoing{rings.outgoing()};
  exchange::ByteRingConsumer incoming{rings.incoming()};
  std::vector<std::weak_ptr<SharedWithProcess>> shared;
  Descriptor socket;
  Descriptor output;
  pid_t pid = -1;
  std::string statm;  // see memory_size()
  Descriptor pidfd;
  const Instant started;
  std::string line;       // incomplete line of its output
  std::string killed_as;  // why this process has ended it; empty: it has not
  event::ProcessEnd killed_for{};
};

EdgeProcess::EdgeProcess(Options options) : options_(std::move(options)), pauses_(options_.stable) {
  if (!start()) {
    throw std::system_error(errno, std::generic_category(), options_.program);
  }
  thread_ = std::thread([this] { run(); });
}

EdgeProcess::~EdgeProcess() {
  finish(Duration::zero());
}

std::shared_ptr<EdgeProcess::Child> EdgeProcess::present() const {
  const std::lock_guard lock(mutex_);
  return child_;
}

// --- messages ------------------------------------------------------------------------------------

std::uint64_t EdgeProcess::number() const {
  const std::lock_guard lock(mutex_);
  return child_ == nullptr ? 0 : child_->number;
}

bool EdgeProcess::send(std::uint64_t number, std::span<const std::byte> message) {
  const std::lock_guard lock(mutex_);
  if (child_ == nullptr || child_->number != number || !child_->outgoing.push(message)) {
    return false;
  }
  options_.bell->ring();
  return true;
}

bool EdgeProcess::share(std::uint64_t number, std::uint64_t tag,
                        const std::shared_ptr<SharedWithProcess>& memory) {
  const std::lock_guard lock(mutex_);
  if (child_ == nullptr || child_->number != number) {
    return false;
  }
  const std::array<int, 2> files = memory->descriptors();
  iovec content{&tag, sizeof tag};
  alignas(cmsghdr) std::array<char, CMSG_SPACE(sizeof files)> control{};
  msghdr message{};
  message.msg_iov = &content;
  message.msg_iovlen = 1;
  message.msg_control = control.data();
  message.msg_controllen = control.size();
  cmsghdr* const head = CMSG_FIRSTHDR(&message);
  head->cmsg_level = SOL_SOCKET;
  head->cmsg_type = SCM_RIGHTS;
  head->cmsg_len = CMSG_LEN(sizeof files);
  std::memcpy(CMSG_DATA(head), files.data(), sizeof files);
  memory->forget_damage();
  if (sendmsg(child_->socket.get(), &message, MSG_DONTWAIT | MSG_NOSIGNAL) !=
      static_cast<ssize_t>(sizeof tag)) {
    return false;
  }
  std::erase_if(child_->shared, [](const auto& other) { return other.expired(); });
  child_->shared.push_back(memory);
  return true;
}

EdgeProcess::Positions EdgeProcess::positions(std::uint64_t number) {
  const std::lock_guard lock(mutex_);
  if (child_ == nullptr || child_->number != number) {
    return {};
  }
  return {child_->outgoing.position(), child_->outgoing.consumed()};
}

std::uint64_t EdgeProcess::receive(std::vector<std::byte>& message) {
  const std::lock_guard lock(mutex_);
  if (child_ == nullptr || !rejected_.empty() || !child_->incoming.front(message)) {
    return 0;
  }
  child_->incoming.pop();
  empty_wakes_ = 0;
  return child_->number;
}

// Octets of the socket mean nothing except that there may be a message.
void EdgeProcess::wait(Duration timeout) {
  std::shared_ptr<Child> child;  // none: nothing that it signals matters
  {
    const std::lock_guard lock(mutex_);
    if (child_ != nullptr && rejected_.empty() && !child_->incoming.broken()) {
      child = child_;
      if (!child->incoming.prepare_wait()) {
        return;
      }
    }
  }
  std::array<pollfd, 2> wakes{{{wakeup_.descriptor(), POLLIN, 0}, {-1, POLLIN, 0}}};
  if (child != nullptr) {
    wakes[1].fd = child->socket.get();
  }
  const timespec limit{static_cast<time_t>(timeout.count() / 1'000'000'000),
                       static_cast<long>(timeout.count() % 1'000'000'000)};
  if (ppoll(wakes.data(), wakes.size(), &limit, nullptr) <= 0) {
    return;
  }
  if (wakes[0].revents != 0) {
    wakeup_.clear();
  }
  if (wakes[1].revents != 0) {
    std::array<char, 64> octets{};
    if (recv(wakes[1].fd, octets.data(), octets.size(), MSG_DONTWAIT) <= 0) {
      // It has closed its end: nothing arrives until its successor runs, which wakes this thread.
      wakes[1].fd = -1;
      ppoll(wakes.data(), wakes.size(), &limit, nullptr);
    } else {
      note_wake(*child);
    }
  }
}

// Without a limit, a process that only signals would keep the thread in wait() busy.
void EdgeProcess::note_wake(const Child& child) {
  {
    const std::lock_guard lock(mutex_);
    if (child_.get() != &child || ++empty_wakes_ <= kMostEmptyWakes) {
      return;
    }
  }
  reject(child.number, "it signalled without messages");
}

void EdgeProcess::reject(std::uint64_t number, std::string_view reason) {
  const std::lock_guard lock(mutex_);
  if (child_ != nullptr && child_->number == number) {
    rejected_ = reason;
    supervisor_.signal();
  }
}

void EdgeProcess::replace(std::uint64_t number, std::string_view reason) {
  const std::lock_guard lock(mutex_);
  if (child_ != nullptr && child_->number == number && replaced_.empty()) {
    replaced_ = reason;
    end_due_ = monotonic_now() + kTimeToEnd;
    supervisor_.signal();
  }
}

void EdgeProcess::finish(Duration limit) {
  if (!thread_.joinable()) {
    return;
  }
  finishing_.raise();
  supervisor_.signal();
  if (const auto child = present()) {
    pollfd end{child->pidfd.get(), POLLIN, 0};
    poll(&end, 1,
         static_cast<int>(std::chrono::duration_cast<std::chrono::milliseconds>(limit).count()));
  }
  kill_.raise();
  supervisor_.signal();
  thread_.join();
}

// --- supervision ---------------------------------------------------------------------------------

bool EdgeProcess::start() {
  LINEGATE_ASSERT(present() == nullptr, "the process before has ended");
  auto child = std::make_shared<Child>(++started_, monotonic_now());
  progress_.begin(child->started);
  auto [socket, socket_of_child] = make_sockets();
  auto [output, output_of_child] = make_pipe();
  fcntl(output.get(), F_SETFL, O_NONBLOCK);
  const Descriptor rings = moved_up(Descriptor(dup(child->rings.descriptor())));
  const Descriptor other_socket = moved_up(std::move(socket_of_child));
  const Descriptor other_output = moved_up(std::move(output_of_child));
  const Descriptor bell = moved_up(Descriptor(dup(options_.bell->descriptor())));
  child->pid = spawn(options_.program, options_.arguments, rings.get(), other_socket.get(),
                     bell.get(), other_output.get());
  if (child->pid < 0) {
    return false;
  }
  child->statm = fmt::format("/proc/{}/statm", child->pid);
  child->pidfd = Descriptor(static_cast<int>(syscall(SYS_pidfd_open, child->pid, 0)));
  child->socket = std::move(socket);
  child->output = std::move(output);
  {
    const std::lock_guard lock(mutex_);
    child_ = std::move(child);
    rejected_.clear();
    replaced_.clear();
    empty_wakes_ = 0;
  }
  wakeup_.signal();
  set_condition(Options::Condition::starting);
  return true;
}

void EdgeProcess::set_condition(Options::Condition condition) {
  using Condition = Options::Condition;
  const bool pauses = condition == Condition::waits;
  LINEGATE_ASSERT(condition_ != Condition::waits || pauses || condition == Condition::starting,
                  "a process that does not run neither works nor hangs");
  if (std::exchange(condition_, condition) != condition || pauses) {
    options_.changed(condition, pauses ? start_due_ : Instant{});
  }
}

void EdgeProcess::run() {
  pthread_setname_np(pthread_self(), "supervisor");
  while (true) {
    const std::shared_ptr<Child> child = present();
    std::array<pollfd, 3> wakes{
        {{supervisor_.descriptor(), POLLIN, 0}, {-1, POLLIN, 0}, {-1, POLLIN, 0}}};
    if (child != nullptr) {
      wakes[1].fd = child->pidfd.get();
      wakes[2].fd = child->output.get();
    }
    const auto look_ms = std::chrono::duration_cast<std::chrono::milliseconds>(kLookPeriod).count();
    poll(wakes.data(), wakes.size(), static_cast<int>(look_ms));
    if (wakes[0].revents != 0) {
      supervisor_.clear();
    }
    const Instant now = monotonic_now();
    if (child != nullptr) {
      look_at(*child, now);
    } else if (finishing_.raised()) {
      return;
    } else if (now >= start_due_) {
      start_again(now);
    }
  }
}

// A refusal of the system must not end this process: it is tried again.
void EdgeProcess::start_again(Instant now) {
  std::string reason;
  int error = 0;
  try {
    if (start()) {
      return;
    }
    error = errno;
    reason = strerror(error);
  } catch (const std::system_error& refused) {
    error = refused.code().value();
    reason = refused.what();
  } catch (const std::exception& other) {
    reason = other.what();
  }
  options_.log(Severity::error,
               fmt::format("the {} process cannot be started: {}", options_.name, reason));
  const Duration pause = pauses_.after({});
  start_due_ = now + pause;
  set_condition(Options::Condition::waits);
  options_.ended({event::ProcessEnd::not_started, static_cast<std::uint32_t>(error), pause,
                  "could not be started: " + reason});
}

void EdgeProcess::note_end(const Child& child, const siginfo_t& end, Instant now) {
  LINEGATE_ASSERT(present() == nullptr, "a process that has ended is not the present one");
  Options::End report{.cause = child.killed_for,
                      .pause = pauses_.after(now - child.started),
                      .words = child.killed_as};
  if (report.words.empty()) {
    const bool exited = end.si_code == CLD_EXITED;
    report.cause = !exited                             ? event::ProcessEnd::signal
                   : end.si_status == kExitOutOfMemory ? event::ProcessEnd::memory
                                                       : event::ProcessEnd::exited;
    report.detail = static_cast<std::uint32_t>(end.si_status);
    report.words = describe_end(end);
  }
  const auto ms = std::chrono::duration_cast<std::chrono::milliseconds>(report.pause).count();
  start_due_ = now + report.pause;
  set_condition(Options::Condition::waits);
  options_.log(Severity::error,
               fmt::format("the {} process {} {}; it is started again{}", options_.name, child.pid,
                           report.words, ms == 0 ? std::string() : fmt::format(" in {} ms", ms)));
  options_.ended(std::move(report));
}

void EdgeProcess::look_at(Child& child, Instant now) {
  read_output(child, false);
  if (has_ended(child, now) || !child.killed_as.empty()) {
    return;
  }
  const std::string reason = reason_to_kill(child, now);
  if (!reason.empty() || kill_.raised()) {
    child.killed_as = "was ended: " + reason;
    kill(child.pid, SIGKILL);
  }
  if (!reason.empty() && child.killed_for == event::ProcessEnd::no_response) {
    set_condition(Options::Condition::hangs);
  } else if (child.rings.progress(0) != 0 && child.rings.progress(1) != 0) {
    set_condition(Options::Condition::working);
  }
}

bool EdgeProcess::has_ended(Child& child, Instant now) {
  siginfo_t end{};
  if (waitid(P_PID, static_cast<id_t>(child.pid), &end, WEXITED | WNOHANG) != 0 ||
      end.si_pid == 0) {
    return false;
  }
  read_output(child, true);
  {
    const std::lock_guard lock(mutex_);
    child_.reset();
  }
  if (!finishing_.raised()) {
    report_end(child, end, now);
  }
  supervisor_.signal();
  return true;
}

void EdgeProcess::report_end(const Child& child, const siginfo_t& end, Instant now) {
  std::string replaced;
  {
    const std::lock_guard lock(mutex_);
    replaced = replaced_;
  }
  if (replaced.empty() || !child.killed_as.empty()) {
    note_end(child, end, now);
    return;
  }
  start_due_ = now;
  set_condition(Options::Condition::waits);
  options_.log(Severity::note, fmt::format("the {} process {} is replaced: {}", options_.name,
                                           child.pid, replaced));
}

// Empty: there is none. A process that was asked to end need not show progress.
std::string EdgeProcess::reason_to_kill(Child& child, Instant now) {
  const std::array counters{child.rings.progress(0), child.rings.progress(1)};
  const bool progress = progress_.look(counters, now);
  child.killed_for = event::ProcessEnd::memory;
  if (std::string excess = excess_of_memory(child); !excess.empty()) {
    return excess;
  }
  const std::lock_guard lock(mutex_);
  child.killed_for = event::ProcessEnd::malformed;
  const bool damaged = std::ranges::any_of(child.shared, [](const auto& memory) {
    const auto shared = memory.lock();
    return shared != nullptr && shared->damaged();
  });
  if (damaged || child.incoming.broken() || child.outgoing.broken()) {
    return "it damaged the memory that both processes share";
  }
  if (!rejected_.empty()) {
    return rejected_;
  }
  child.killed_for = event::ProcessEnd::no_response;
  if (!replaced_.empty()) {
    return now >= end_due_ ? "it did not end when it was asked to" : "";
  }
  return progress ? "" : "it did not respond";
}

std::string EdgeProcess::excess_of_memory(const Child& child) const {
  const std::size_t used = memory_size(child.statm.c_str()).resident;
  if (options_.memory == 0 || used <= options_.memory) {
    return {};
  }
  constexpr std::size_t kMegabyte = 1'000'000;
  return fmt::format("it used {} MB of memory, more than the permitted {} MB", used / kMegabyte,
                     options_.memory / kMegabyte);
}

// all: also an incomplete line at the end.
void EdgeProcess::read_output(Child& child, bool all) {
  std::array<char, 4096> text{};
  for (int i = 0; i < kReadsPerLook; ++i) {
    const ssize_t length = read(child.output.get(), text.data(), text.size());
    if (length == 0) {
      child.output = Descriptor();  // it has closed its end
    }
    if (length <= 0) {
      break;
    }
    for (const char c : std::string_view(text.data(), static_cast<std::size_t>(length))) {
      if (c != '\n' && child.line.size() < kLongestLine) {
        child.line += c;
      } else if (!child.line.empty()) {
        report_line(std::exchange(child.line, {}));
      }
    }
  }
  if (all && !child.line.empty()) {
    report_line(std::exchange(child.line, {}));
  }
}

// A line may begin with the severity as the journal has it (sd-daemon(3)).
void EdgeProcess::report_line(std::string_view line) const {
  Severity severity = Severity::error;
  if (line.starts_with("<4>") || line.starts_with("<3>")) {
    severity = line[1] == '4' ? Severity::warning : Severity::error;
    line.remove_prefix(3);
  }
  options_.output(severity, line);
}

}  // namespace linegate::gateway
