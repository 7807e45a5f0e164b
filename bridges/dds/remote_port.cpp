// SPDX-License-Identifier: Apache-2.0
#include "bridges/dds/remote_port.h"

#include <algorithm>
#include <chrono>
#include <functional>
#include <map>
#include <mutex>
#include <utility>

#include "bridges/dds/declared_topics.h"
#include "bridges/dds/named_read_type.h"
#include "bridges/dds/port_codec.h"
#include "bridges/dds/retained_messages.h"
#include "bridges/dds/sample_port.h"

namespace linegate::dds {
namespace {

using Key = RetainedMessages::Key;
using Policy = RetainedMessages::Policy;

// As deep as the history of the writers in linegate-profiles.xml.
constexpr Policy kNewest{};
constexpr Policy kEvents{.depth = 1'000};
constexpr Policy kReplies{.depth = 256};  // a client that misses one repeats its request
constexpr Policy kImages{.depth = 8, .once = true, .newest_always = true};
constexpr Policy kReceptions{.depth = 4'096, .once = true};
constexpr Policy kUpdates{.once = true};
constexpr Policy kNamed{.depth = 8, .once = true};
constexpr Policy kEnding{.once = true, .only = true};

constexpr Duration kStopPeriod = std::chrono::milliseconds(100);  // between calls of stop()
constexpr Duration kRetryPeriod = std::chrono::milliseconds(2);   // while the ring is full
constexpr int kControlsPerPoll = 64;
// Time for what is left to be sent, besides the last words.
constexpr Duration kTimeToEnd = std::chrono::milliseconds(1'500);

constexpr std::uint8_t number_of(ToEndpoints kind) {
  return static_cast<std::uint8_t>(kind);
}

constexpr bool is_sample(FromEndpoints kind) {
  return kind == FromEndpoints::output_write || kind == FromEndpoints::command_request ||
         kind == FromEndpoints::line_state || kind == FromEndpoints::image_layout ||
         kind == FromEndpoints::process_image || kind == FromEndpoints::named_write;
}

class RemotePort final : public SamplePort {
 public:
  RemotePort(const GatewayOptions& options, std::unique_ptr<MessageLink> link);
  ~RemotePort() override;
  RemotePort(const RemotePort&) = delete;
  RemotePort& operator=(const RemotePort&) = delete;

  // Waits for the first answer to the options; see make_remote_bridge().
  std::vector<Diagnostic> start(Duration patience, const std::function<bool()>& stop);

  bool add_line(const std::string& line) override;
  void remove_line(const std::string& line) override;
  void forget_pdos(std::string_view line) override;

  bool write(v1::GatewayState& sample) override {
    return keep(ToEndpoints::gateway_state, {}, {}, kNewest, sample);
  }
  bool write(v1::LineState& sample) override {
    return keep(ToEndpoints::line_state, sample.line().c_str(), {}, kNewest, sample);
  }
  bool write(v1::NodeState& sample) override {
    return keep(ToEndpoints::node_state, sample.line().c_str(), std::to_string(sample.node()),
                kNewest, sample);
  }
  bool write(v1::OutputState& sample) override {
    return keep(ToEndpoints::output_state, sample.line().c_str(), std::to_string(sample.group()),
                kNewest, sample);
  }
  bool write(v1::ImageLayout& sample) override {
    return keep(ToEndpoints::image_layout, sample.line().c_str(),
                std::to_string(sample.direction()) + ' ' + std::to_string(sample.part()), kNewest,
                sample);
  }
  bool write(v1::ProcessImage& sample) override {
    return keep(ToEndpoints::process_image, sample.line().c_str(),
                std::to_string(sample.direction()), kImages, sample);
  }
  bool share_images(const std::string& line, std::shared_ptr<SharedFiles> files) override;
  bool write(v1::PdoUpdate& sample) override;
  bool write(v1::PdoReception& sample) override {
    return keep(ToEndpoints::pdo_reception, sample.line().c_str(), {}, kReceptions, sample);
  }
  bool write(v1::Event& sample) override {
    return keep(ToEndpoints::event, sample.line().c_str(), {}, kEvents, sample);
  }
  bool write(v1::CommandReply& sample, const std::string& partition) override;
  bool add_named(const NamedTopic& topic) override {
    return declare(ToEndpoints::named_topic, topic, written_);
  }
  void remove_named(std::span<const std::string> topics) override {
    end(ToEndpoints::end_topics, topics, written_);
  }
  bool write_named(std::string_view topic, std::span<const std::byte> sample) override;
  bool accepts_named(std::string_view topic) const override;
  bool has_named_readers(std::string_view topic) override;
  void watch_named_readers(std::function<void()> changed) override {
    const std::lock_guard lock(watch_mutex_);
    readers_changed_ = std::move(changed);
  }
  bool add_named_reader(const NamedTopic& topic) override {
    return declare(ToEndpoints::named_set, topic, read_);
  }
  void remove_named_readers(std::span<const std::string> topics) override {
    end(ToEndpoints::end_sets, topics, read_);
  }
  bool follow(const std::vector<RemoteLine>& lines) override;
  bool accepts_image(std::string_view line, image::Direction direction) const override;
  std::uint64_t failed_later() const override;
  std::uint64_t process_starts() const override {
    const std::lock_guard lock(mutex_);
    return starts_;
  }

  std::int64_t next_expiry() const override { return locked().next_expiry; }
  bool replace_process(std::string_view reason) override;

  bool wait(Duration timeout) override;
  void wake() override { link_->wake(); }
  Taken take(v1::OutputWrite& sample, Participant& from) override {
    return take(FromEndpoints::output_write, sample, from);
  }
  Taken take(v1::CommandRequest& sample, Participant& from) override {
    return take(FromEndpoints::command_request, sample, from);
  }
  Taken take_named(NamedReceived& sample, Participant& from) override;
  Taken take_other(v1::LineState& sample) override {
    return take_line(FromEndpoints::line_state, sample);
  }
  Taken take_other(v1::ImageLayout& sample) override {
    return take_line(FromEndpoints::image_layout, sample);
  }
  Taken take_other(v1::ProcessImage& sample) override {
    return take_line(FromEndpoints::process_image, sample);
  }
  void all_outputs_taken() override {}
  void all_commands_taken() override {}
  std::uint64_t pop_unreadable() override { return std::exchange(unreadable_, 0); }
  std::string_view output_misfit() override { return taken(output_misfit_, last_misfit_); }
  std::string_view command_misfit() override { return taken(command_misfit_, last_misfit_); }
  Misfit named_misfit() override {
    last_misfit_topic_ = std::exchange(misfit_topic_, {});
    return {last_misfit_topic_, taken(named_misfit_, last_misfit_)};
  }

  std::size_t namesakes() const override { return locked().namesakes; }
  std::vector<std::string> other_gateways() const override { return locked().other_gateways; }
  DiscoveryCounters discovery() const override { return total().discovery; }
  guard::Counters guard_counters() const override { return total().guard; }

 private:
  template <class Sample>
  bool keep(ToEndpoints kind, std::string line, std::string instance, Policy policy,
            const Sample& sample) {
    const std::lock_guard lock(mutex_);
    return keep_locked(kind, std::move(line), std::move(instance), policy, sample);
  }
  template <class Sample>
  bool keep_locked(ToEndpoints kind, std::string line, std::string instance, Policy policy,
                   const Sample& sample, std::uint32_t tally = 0);
  bool keep_buffer(Key key, Policy policy, std::uint32_t tally);
  void keep_text(ToEndpoints kind, std::uint8_t topic, const std::string& line, Policy policy);
  bool declare(ToEndpoints kind, const NamedTopic& topic, DeclaredTopics& among);
  void end(ToEndpoints kind, std::span<const std::string> topics, DeclaredTopics& among);
  void report_readers();
  void forget_named();
  bool note_named_readers();
  bool note_named_misfit();
  void pump();
  void note_done() const;
  bool pass_files(ProcessNumber process, const PortMessage& message);
  void note_process(ProcessNumber process);
  bool fetch();
  void handle_control();
  void note_started(std::vector<Diagnostic> diagnostics);
  void note_failed(std::vector<Diagnostic> diagnostics);
  template <class Sample>
  Taken take(FromEndpoints kind, Sample& sample, Participant& from);
  template <class Sample>
  Taken take_line(FromEndpoints kind, Sample& sample);
  bool is_next(FromEndpoints kind);
  Taken taken_if(bool good);
  static std::string_view taken(std::string& misfit, std::string& last) {
    last = std::exchange(misfit, {});
    return last;
  }
  EndpointStatus locked() const {
    const std::lock_guard lock(mutex_);
    return status_;
  }
  EndpointStatus total() const;

  const Duration last_words_;
  const std::unique_ptr<MessageLink> link_;

  mutable std::mutex mutex_;  // write() runs in two threads; held for a copy of messages at most
  mutable RetainedMessages retained_;  // what was carried out is noted before each question
  PortMessage buffer_;
  std::map<std::uint64_t, std::shared_ptr<SharedFiles>> shared_;  // by tag, of present lines
  std::map<std::string, std::uint64_t> tags_;                     // of them, by line
  std::uint64_t last_tag_ = 0;
  ProcessNumber process_ = 0;  // the one that the messages are sent to
  ProcessNumber starts_ = 0;   // the newest process
  bool ready_ = false;         // it has created its endpoints
  DeclaredTopics written_;     // the named topics of the gateway
  DeclaredTopics read_;        // those that applications write
  std::uint64_t ends_ = 0;     // messages that end topics
  EndpointStatus status_;      // of that process
  EndpointStatus before_;      // sums of the counters of all processes before it

  std::mutex watch_mutex_;  // is locked last
  std::function<void()> readers_changed_;

  // Used by the polling thread.
  PortMessage received_;  // empty: none
  ProcessNumber received_of_ = 0;
  ProcessNumber answered_ = 0;  // that process has sent `ready` or `failed`
  std::uint64_t unreadable_ = 0;
  std::string output_misfit_;
  std::string command_misfit_;
  std::string named_misfit_;
  std::string misfit_topic_;
  std::string last_misfit_;
  std::string last_misfit_topic_;
  bool starting_ = true;                 // start() has not returned
  bool started_ = false;                 // a process has sent `ready`
  bool failed_ = false;                  // a process has sent `failed` before start() returned
  std::vector<Diagnostic> diagnostics_;  // of the first answer before start() returned
};

RemotePort::RemotePort(const GatewayOptions& options, std::unique_ptr<MessageLink> link)
    : last_words_(options.last_words), link_(std::move(link)) {
  encode(options, buffer_);
  retained_.add({.line = {}, .topic = number_of(ToEndpoints::configure)}, kNewest, buffer_);
}

// The process receives what is left, and a request to end. It has a limited time for both.
RemotePort::~RemotePort() {
  using Clock = std::chrono::steady_clock;
  const auto deadline = Clock::now() + kTimeToEnd + last_words_;
  {
    const std::lock_guard lock(mutex_);
    encode(ToEndpoints::stop, "", buffer_);
    retained_.add({.line = {}, .topic = number_of(ToEndpoints::stop)}, kNewest, buffer_);
  }
  for (bool left = true; left && Clock::now() < deadline;) {
    {
      const std::lock_guard lock(mutex_);
      pump();
      left = retained_.next() != nullptr && link_->process() != 0;
    }
    if (left)
      link_->wait(kRetryPeriod);
  }
  link_->finish(std::max(Duration::zero(), Duration{deadline - Clock::now()}));
}

// A process that never answers is no error of the configuration: datagrams may cause it.
std::vector<Diagnostic> RemotePort::start(Duration patience, const std::function<bool()>& stop) {
  using Clock = std::chrono::steady_clock;
  const auto deadline = Clock::now() + patience;
  bool stopped = false;
  while (!started_ && !failed_ && Clock::now() < deadline && !(stopped = stop()))
    wait(std::min(kStopPeriod, Duration{deadline - Clock::now()}));
  starting_ = false;
  if (!started_ && !failed_ && !stopped) {
    link_->log(Severity::error,
               "the DDS process has not answered yet: the lines start without DDS");
  }
  return std::move(diagnostics_);
}

// --- out -----------------------------------------------------------------------------------------

// The mutex is held.
template <class Sample>
bool RemotePort::keep_locked(ToEndpoints kind, std::string line, std::string instance,
                             Policy policy, const Sample& sample, std::uint32_t tally) {
  try {
    encode_sample(number_of(kind), sample, buffer_);
  } catch (const std::exception&) {
    return false;  // its size is beyond that of any buffer
  }
  return keep_buffer({std::move(line), number_of(kind), std::move(instance)}, policy, tally);
}

// The mutex is held.
bool RemotePort::keep_buffer(Key key, Policy policy, std::uint32_t tally) {
  if (buffer_.size() > kLongestMessage)
    return false;
  retained_.add(std::move(key), policy, buffer_, tally);
  pump();
  return true;
}

bool RemotePort::write(v1::CommandReply& sample, const std::string& partition) {
  const std::lock_guard lock(mutex_);
  try {
    encode_sample_in(partition, ToEndpoints::command_reply, sample, buffer_);
  } catch (const std::exception&) {
    return false;  // as in keep_locked()
  }
  return keep_buffer({.line = {}, .topic = number_of(ToEndpoints::command_reply)}, kReplies, 0);
}

// The receptions of an update that was not sent yet count with the newer one. The polling thread
// must not send it in between: its receptions would be counted twice.
bool RemotePort::write(v1::PdoUpdate& sample) {
  std::string instance = std::to_string(sample.node()) + ' ' + std::to_string(sample.pdo());
  const Key key{sample.line().to_string(), number_of(ToEndpoints::pdo_update), instance};
  const std::lock_guard lock(mutex_);
  sample.receptions(sample.receptions() + retained_.unsent_tally(key));
  return keep_locked(ToEndpoints::pdo_update, key.line, std::move(instance), kUpdates, sample,
                     sample.receptions());
}

void RemotePort::keep_text(ToEndpoints kind, std::uint8_t topic, const std::string& line,
                           Policy policy) {
  encode(kind, line, buffer_);
  retained_.add({line, topic}, policy, buffer_);
}

// The first add_line() of a line stays before its events, which outlive the line. A later one, of a
// line that is made anew, follows its remove_line().
bool RemotePort::add_line(const std::string& line) {
  constexpr std::uint8_t kAgain = 0xFF;
  const std::lock_guard lock(mutex_);
  const std::uint8_t first = number_of(ToEndpoints::add_line);
  keep_text(ToEndpoints::add_line, retained_.contains({line, first}) ? kAgain : first, line,
            kNewest);
  pump();
  return true;
}

bool RemotePort::share_images(const std::string& line, std::shared_ptr<SharedFiles> files) {
  const std::lock_guard lock(mutex_);
  shared_.emplace(++last_tag_, std::move(files));
  tags_[line] = last_tag_;
  encode(SharedImagesMessage{last_tag_, line}, buffer_);
  retained_.add({line, number_of(ToEndpoints::share_images)}, kNewest, buffer_);
  pump();
  return true;
}

bool RemotePort::follow(const std::vector<RemoteLine>& lines) {
  if (lines.size() > kMostFollowed)
    return false;
  const std::lock_guard lock(mutex_);
  encode(lines, buffer_);
  retained_.add({.line = {}, .topic = number_of(ToEndpoints::follow)}, kNewest, buffer_);
  pump();
  return true;
}

bool RemotePort::declare(ToEndpoints kind, const NamedTopic& topic, DeclaredTopics& among) {
  const std::lock_guard lock(mutex_);
  encode(kind, {among.add(topic), topic}, buffer_);
  retained_.add({topic.line, number_of(kind), topic.topic}, kNewest, buffer_);
  pump();
  return true;
}

// Samples that were not carried out are dropped with their topic. A new process has no topic that
// could end.
void RemotePort::end(ToEndpoints kind, std::span<const std::string> topics, DeclaredTopics& among) {
  const std::lock_guard lock(mutex_);
  const ToEndpoints declared =
      kind == ToEndpoints::end_topics ? ToEndpoints::named_topic : ToEndpoints::named_set;
  pump();
  while (!topics.empty()) {
    std::vector<std::uint32_t> ending;
    for (const std::string& topic : topics.first(std::min(topics.size(), kMostEnding))) {
      const DeclaredTopics::Declared* const known = among.find(topic);
      if (known == nullptr)
        continue;
      const Key key{known->line, number_of(declared), topic};
      const Key samples{known->line, number_of(ToEndpoints::named_sample), topic};
      retained_.drop([&](const Key& of) { return of == key || of == samples; });
      ending.push_back(among.remove(topic));
    }
    topics = topics.subspan(std::min(topics.size(), kMostEnding));
    if (process_ == 0 || ending.empty())
      continue;
    encode(kind, ending, buffer_);
    retained_.add({.line = {}, .topic = number_of(kind), .instance = std::to_string(++ends_)},
                  kEnding, buffer_);
  }
  pump();
}

bool RemotePort::write_named(std::string_view topic, std::span<const std::byte> sample) {
  const std::lock_guard lock(mutex_);
  const DeclaredTopics::Declared* const known = written_.find(topic);
  if (known == nullptr)
    return false;
  encode(NumberedSample{known->number, sample}, buffer_);
  return keep_buffer({known->line, number_of(ToEndpoints::named_sample), known->topic}, kNamed, 0);
}

bool RemotePort::accepts_named(std::string_view topic) const {
  const std::lock_guard lock(mutex_);
  note_done();
  const DeclaredTopics::Declared* const known = written_.find(topic);
  return ready_ && known != nullptr &&
         retained_.pending({known->line, number_of(ToEndpoints::named_sample), known->topic}) <
             kNamed.depth;
}

bool RemotePort::has_named_readers(std::string_view topic) {
  const std::lock_guard lock(mutex_);
  bool again = false;
  const bool present = written_.has_readers(topic, again);
  if (again)
    report_readers();
  return present;
}

void RemotePort::report_readers() {
  const std::lock_guard lock(watch_mutex_);
  if (readers_changed_)
    readers_changed_();
}

// The process publishes the last images of the line before it removes it.
void RemotePort::remove_line(const std::string& line) {
  const std::lock_guard lock(mutex_);
  retained_.drop([&](const Key& key) {
    return key.line == line && key.topic != number_of(ToEndpoints::event) &&
           key.topic != number_of(ToEndpoints::add_line);
  });
  if (const auto tag = tags_.find(line); tag != tags_.end()) {
    shared_.erase(tag->second);
    tags_.erase(tag);
  }
  keep_text(ToEndpoints::remove_line, number_of(ToEndpoints::remove_line), line, kNewest);
  pump();
}

void RemotePort::forget_pdos(std::string_view line) {
  const std::lock_guard lock(mutex_);
  retained_.drop([&](const Key& key) {
    return key.line == line && key.topic == number_of(ToEndpoints::pdo_update);
  });
  keep_text(ToEndpoints::forget_pdos, number_of(ToEndpoints::forget_pdos), std::string(line),
            kUpdates);
  pump();
}

bool RemotePort::accepts_image(std::string_view line, image::Direction direction) const {
  const std::lock_guard lock(mutex_);
  note_done();
  const Key key{std::string(line), number_of(ToEndpoints::process_image),
                std::to_string(static_cast<unsigned>(direction))};
  return ready_ && retained_.pending(key) + 1 < kImages.depth;
}

// A process that was slow has carried out more than it had at the last pump(). The mutex is held.
void RemotePort::note_done() const {
  if (process_ != 0 && link_->process() == process_)
    retained_.note_done(link_->positions(process_).done);
}

// Sends as much as there is room for. The mutex is held.
void RemotePort::pump() {
  const ProcessNumber process = link_->process();
  if (process != process_)
    note_process(process);
  if (process == 0)
    return;
  retained_.note_done(link_->positions(process).done);
  while (const PortMessage* message = retained_.next()) {
    if (!pass_files(process, *message) || !link_->send(process, *message))
      return;
    retained_.note_sent(link_->positions(process).sent);
  }
}

// Memory that was passed and whose message finds no room is passed again with it.
bool RemotePort::pass_files(ProcessNumber process, const PortMessage& message) {
  if (kind_of(message) != number_of(ToEndpoints::share_images))
    return true;
  const auto shared = decode_shared_images(message);
  const auto files = shared ? shared_.find(shared->tag) : shared_.end();
  return files != shared_.end() && link_->share(process, files->first, files->second);
}

void RemotePort::note_process(ProcessNumber process) {
  process_ = process;
  starts_ = std::max(starts_, process);
  ready_ = false;
  before_.discovery.discovered += status_.discovery.discovered;
  before_.discovery.gone += status_.discovery.gone + status_.discovery.participants;
  before_.guard.received += status_.guard.received;
  for (std::size_t i = 0; i < before_.guard.dropped.size(); ++i)
    before_.guard.dropped[i] += status_.guard.dropped[i];
  before_.failed += status_.failed;
  status_ = {};
  forget_named();
  retained_.restart();
}

// The readers of a new process come to it, and then receive samples that are made anew: one that
// was made before would be old for a reader that comes later.
void RemotePort::forget_named() {
  retained_.drop([](const Key& key) {
    return key.topic == number_of(ToEndpoints::named_sample) ||
           key.topic == number_of(ToEndpoints::end_topics) ||
           key.topic == number_of(ToEndpoints::end_sets);
  });
  written_.forget_readers();
  report_readers();
}

EndpointStatus RemotePort::total() const {
  const std::lock_guard lock(mutex_);
  EndpointStatus out = status_;
  out.discovery.discovered += before_.discovery.discovered;
  out.discovery.gone += before_.discovery.gone;
  out.guard.received += before_.guard.received;
  for (std::size_t i = 0; i < out.guard.dropped.size(); ++i)
    out.guard.dropped[i] += before_.guard.dropped[i];
  return out;
}

// What the process does not carry out before its end, the next one receives. The request to end is
// not kept for it.
bool RemotePort::replace_process(std::string_view reason) {
  const std::lock_guard lock(mutex_);
  pump();
  encode(ToEndpoints::stop, "", buffer_);
  if (!ready_ || !link_->send(process_, buffer_))
    return false;
  link_->replace(process_, reason);
  return true;
}

std::uint64_t RemotePort::failed_later() const {
  const std::lock_guard lock(mutex_);
  return before_.failed + status_.failed + retained_.lost();
}

// --- in ------------------------------------------------------------------------------------------

bool RemotePort::wait(Duration timeout) {
  bool waits_for_room = false;
  {
    const std::lock_guard lock(mutex_);
    pump();
    waits_for_room = retained_.next() != nullptr && process_ != 0;
  }
  if (received_.empty() && !fetch())
    link_->wait(waits_for_room ? std::min(timeout, kRetryPeriod) : timeout);
  {
    const std::lock_guard lock(mutex_);
    pump();
  }
  return !received_.empty() || fetch();
}

// Returns true if there is a sample in received_. Other messages are handled; their number is
// limited, because a process that was taken over may send them without end. A process answers the
// options once, before everything else.
bool RemotePort::fetch() {
  for (int i = 0; i < kControlsPerPoll; ++i) {
    received_of_ = link_->receive(received_);
    if (received_of_ == 0) {
      received_.clear();
      return false;
    }
    const auto kind = static_cast<FromEndpoints>(kind_of(received_));
    const bool is_answer = kind == FromEndpoints::ready || kind == FromEndpoints::failed;
    if (is_answer == (answered_ == received_of_)) {
      link_->reject(received_of_, "it sent messages in another order than permitted");
    } else if (is_sample(kind)) {
      return true;
    } else {
      handle_control();
    }
    received_.clear();
  }
  return false;
}

void RemotePort::handle_control() {
  bool good = false;
  switch (static_cast<FromEndpoints>(kind_of(received_))) {
    case FromEndpoints::ready:
      if (auto diagnostics = decode_diagnostics(received_)) {
        note_started(std::move(*diagnostics));
        good = true;
      }
      break;
    case FromEndpoints::failed:
      if (auto diagnostics = decode_diagnostics(received_);
          diagnostics && has_errors(*diagnostics)) {
        note_failed(std::move(*diagnostics));
        good = true;
      }
      break;
    case FromEndpoints::unreadable:
      if (const auto samples = decode_unreadable(received_)) {
        unreadable_ += *samples;
        good = true;
      }
      break;
    case FromEndpoints::output_misfit:
    case FromEndpoints::command_misfit:
      if (auto policy = decode_text(received_); policy && is_policy_name(*policy)) {
        const bool of_outputs =
            static_cast<FromEndpoints>(kind_of(received_)) == FromEndpoints::output_misfit;
        (of_outputs ? output_misfit_ : command_misfit_) = std::move(*policy);
        good = true;
      }
      break;
    case FromEndpoints::status:
      if (auto status = decode_status(received_)) {
        const std::lock_guard lock(mutex_);
        if (received_of_ == process_)
          status_ = std::move(*status);
        good = true;
      }
      break;
    case FromEndpoints::named_readers:
      good = note_named_readers();
      break;
    case FromEndpoints::named_misfit:
      good = note_named_misfit();
      break;
    case FromEndpoints::output_write:
    case FromEndpoints::command_request:
    case FromEndpoints::line_state:
    case FromEndpoints::image_layout:
    case FromEndpoints::process_image:
    case FromEndpoints::named_write:
      break;
  }
  if (!good)
    link_->reject(received_of_, "it sent a malformed message");
}

// Both return false if the message is malformed. A topic may have ended meanwhile.
bool RemotePort::note_named_readers() {
  const auto readers = decode_named_readers(received_);
  const std::lock_guard lock(mutex_);
  if (!readers || !written_.was_given(readers->topic))
    return false;
  if (received_of_ == process_) {
    written_.note_readers(readers->topic, readers->present);
    report_readers();
  }
  return true;
}

bool RemotePort::note_named_misfit() {
  auto misfit = decode_named_misfit(received_);
  const std::lock_guard lock(mutex_);
  if (!misfit || !read_.was_given(misfit->topic) || !is_policy_name(misfit->policy))
    return false;
  if (const DeclaredTopics::Declared* const known = read_.find(misfit->topic)) {
    misfit_topic_ = known->topic;
    named_misfit_ = std::move(misfit->policy);
  }
  return true;
}

void RemotePort::note_started(std::vector<Diagnostic> diagnostics) {
  answered_ = received_of_;
  {
    const std::lock_guard lock(mutex_);
    ready_ = ready_ || received_of_ == process_;
  }
  const bool again = std::exchange(started_, true);
  if (starting_) {
    diagnostics_ = std::move(diagnostics);
  } else {
    link_->log(Severity::note, again ? "the DDS process runs again" : "the DDS process runs");
  }
}

void RemotePort::note_failed(std::vector<Diagnostic> diagnostics) {
  answered_ = received_of_;
  if (starting_) {
    failed_ = true;
    diagnostics_ = std::move(diagnostics);
    return;
  }
  for (const Diagnostic& diagnostic : diagnostics)
    link_->log(diagnostic.severity, to_string(diagnostic));
}

template <class Sample>
SamplePort::Taken RemotePort::take(FromEndpoints kind, Sample& sample, Participant& from) {
  return is_next(kind) ? taken_if(decode_received(received_, from, sample)) : Taken::none;
}

template <class Sample>
SamplePort::Taken RemotePort::take_line(FromEndpoints kind, Sample& sample) {
  return is_next(kind) ? taken_if(decode_sample(received_, sample)) : Taken::none;
}

// A sample for a type that no longer exists is dropped, because its topic may have another one now.
SamplePort::Taken RemotePort::take_named(NamedReceived& sample, Participant& from) {
  if (!is_next(FromEndpoints::named_write))
    return Taken::none;
  const auto write = decode_named_write(received_, from);
  bool good = false;
  bool present = false;
  if (write) {
    const std::lock_guard lock(mutex_);
    const DeclaredTopics::Declared* const known = read_.find(write->topic);
    present = known != nullptr;
    good = present ? write->sample.size() <= known->max_size : read_.was_given(write->topic);
    if (present && good) {
      sample.topic = known->topic;
      sample.octets.assign(write->sample.begin(), write->sample.end());
    }
  }
  const Taken taken = taken_if(good);
  return taken == Taken::sample && !present ? Taken::invalid : taken;
}

// False also if a sample of another topic is next.
bool RemotePort::is_next(FromEndpoints kind) {
  return (!received_.empty() || fetch()) && kind_of(received_) == static_cast<std::uint8_t>(kind);
}

SamplePort::Taken RemotePort::taken_if(bool good) {
  received_.clear();
  if (!good) {
    link_->reject(received_of_, "it sent a malformed sample");
    return Taken::invalid;
  }
  return Taken::sample;
}

}  // namespace

Loaded<std::unique_ptr<GatewayBridge>> make_remote_bridge(const GatewayOptions& options,
                                                          std::unique_ptr<MessageLink> link,
                                                          Duration patience,
                                                          const std::function<bool()>& stop) {
  Loaded<std::unique_ptr<GatewayBridge>> result;
  auto port = std::make_unique<RemotePort>(options, std::move(link));
  result.diagnostics = port->start(patience, stop);
  if (!has_errors(result.diagnostics))
    result.value = GatewayBridge::make(options, std::move(port));
  return result;
}

}  // namespace linegate::dds
