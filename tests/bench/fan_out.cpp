// SPDX-License-Identifier: Apache-2.0
// The cost of an image for its writer, by the number of clients that receive it: a bare writer by
// reliable unicast, a gateway, and a gateway with `dds: {fan_out: multicast}`. Each client is a
// process with all topics of a console. Writer and clients are in two network namespaces with a
// cable between them. Needs root.
#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fcntl.h>
#include <linegatePubSubTypes.h>
#include <sched.h>
#include <sys/wait.h>
#include <unistd.h>

#include "bridges/dds/client.h"
#include "bridges/dds/image_samples.h"
#include "bridges/dds/profiles.h"
#include "bridges/dds/publisher.h"

#include "tests/bench/image_counts.h"
#include "tests/bench/measure.h"
#include "tests/bench/processes.h"

namespace linegate::bench {
namespace {

namespace fast = eprosima::fastdds::dds;
using namespace std::chrono_literals;

constexpr std::array<std::size_t, 3> kReaders{1, 10, 50};
constexpr std::size_t kMostReaders = 100;
constexpr std::size_t kOctets = 512;  // of an image
constexpr auto kPeriod = 10ms;
constexpr int kWindows = 5;
constexpr auto kWindow = 2s;
constexpr auto kPatience = 300s;
constexpr const char* kLine = "line1";

enum class Way : std::uint8_t { bare, unicast, multicast };

// Of all processes of the measurement.
struct Shared {
  std::atomic<std::uint64_t> written;
  std::array<ImageCounts, kMostReaders> readers;
};

struct Settings {
  std::string profiles;
  std::uint32_t domain = 0;
  Shared* shared = nullptr;
  pid_t hosts = 0;  // a process in the network of the readers
};

void command(const std::string& text) {
  require(std::system(text.c_str()) == 0, text + " failed");
}

// --- the processes ------------------------------------------------------------------------------

void run_reader(const Settings& settings, std::size_t number, bool multicast) {
  const std::string network = "/proc/" + std::to_string(settings.hosts) + "/ns/net";
  const int other = ::open(network.c_str(), O_RDONLY | O_CLOEXEC);
  require(::setns(other, CLONE_NEWNET) == 0, "no network of the readers");
  dds::ClientOptions options;
  options.domain = settings.domain;
  options.profile_file = settings.profiles;
  options.pdos = false;
  options.receptions = false;
  options.network.multicast_images = multicast;
  auto made = dds::Client::make(options);
  require(made.ok(), made.diagnostics.empty() ? "no client" : to_string(made.diagnostics.front()));
  ImageCounter images(settings.shared->readers[number]);
  for (;;)
    (*made.value)->poll(100ms, images);
}

image::Snapshot new_image() {
  image::Snapshot out;
  out.layout_id = 1;
  out.bytes.assign(kOctets, std::byte{0x55});
  out.changed.assign(1, 0xFF);
  out.valid.assign(1, ~std::uint64_t{0});
  return out;
}

void use_first_processor() {
  cpu_set_t first;
  CPU_ZERO(&first);
  CPU_SET(0, &first);
  require(::sched_setaffinity(0, sizeof first, &first) == 0, "no processor");
}

template <class Write>
[[noreturn]] void write_images(Shared& shared, Write write) {
  image::Snapshot image = new_image();
  for (auto next = std::chrono::steady_clock::now();; next += kPeriod) {
    std::this_thread::sleep_until(next);
    ++image.sequence;
    require(write(image), "an image was refused");
    ++shared.written;
  }
}

// A participant without anything of Linegate but the profiles and the type.
void run_bare(const Settings& settings) {
  std::vector<Diagnostic> problems;
  require(dds::load_profiles(settings.profiles, problems).has_value(), "no profiles");
  auto* factory = fast::DomainParticipantFactory::get_instance();
  fast::DomainParticipantQos qos;
  factory->get_participant_qos_from_profile(dds::kParticipantProfile, qos);
  qos.allocation().participants.maximum = 2 * kMostReaders;
  auto* participant = factory->create_participant(settings.domain, qos);
  fast::TypeSupport type(new v1::ProcessImagePubSubType());
  type->auto_fill_type_information(false);
  type->auto_fill_type_object(false);
  type.register_type(participant);
  auto* topic = participant->create_topic(v1::TOPIC_PROCESS_IMAGE, type.get_type_name(),
                                          fast::TOPIC_QOS_DEFAULT);
  auto* publisher = participant->create_publisher(fast::PUBLISHER_QOS_DEFAULT);
  auto* writer = publisher->create_datawriter_with_profile(topic, v1::TOPIC_PROCESS_IMAGE);
  require(writer != nullptr, "no writer");
  v1::ProcessImage sample;
  sample.gateway("bare");
  sample.line(kLine);
  sample.incarnation(1);
  write_images(*settings.shared, [&](const image::Snapshot& image) {
    return dds::to_wire(image, {}, sample) && writer->write(&sample);
  });
}

class Ignore : public dds::GatewayHandler {
 public:
  void on_output_write(dds::OutputMessage) override {}
  void on_command(dds::CommandMessage) override {}
  void on_gateway_command(dds::GatewayCommandMessage) override {}
  void on_output_refused(const dds::RequestOrigin&, std::uint16_t, line::OutputRefusal,
                         std::string_view) override {}
  void on_command_refused(const dds::RequestOrigin&, std::uint8_t, line::Refusal,
                          std::string_view) override {}
};

void run_gateway(const Settings& settings, bool multicast) {
  dds::GatewayOptions options{"gateway", 1, settings.domain, settings.profiles, {kLine}};
  options.participants = 2 * kMostReaders;
  options.network.multicast_images = multicast;
  auto made = dds::GatewayBridge::make(options);
  require(made.ok(), "no gateway");
  dds::GatewayBridge& bridge = **made.value;
  const std::jthread requests([&] {  // as a gateway's
    Ignore handler;
    for (;;)
      bridge.poll(100ms, handler);
  });
  std::uint64_t count = 0;
  write_images(*settings.shared, [&](const image::Snapshot& image) {
    if (count++ % 100 == 0) {  // as a gateway does each second
      bridge.publish(dds::GatewayInfo{.version = "1"}, Instant{});
      bridge.publish(dds::LineInfo{kLine, "virtual:x", 500'000, dds::Access::all},
                     line::LineState{}, Instant{});
    }
    return bridge.publish(kLine, image);
  });
}

// --- the measurement ----------------------------------------------------------------------------

struct Figure {
  double cost = 0;  // us of the writer for an image
  std::uint64_t lost = 0;
};

// Until each reader has received some images.
void await_readers(const Settings& settings, const std::vector<pid_t>& clients) {
  const auto until = std::chrono::steady_clock::now() + kPatience;
  const auto readers = std::span(settings.shared->readers).first(clients.size());
  const auto without = [&] {
    return std::ranges::count_if(readers, [](const ImageCounts& it) { return it.received <= 20; });
  };
  while (without() != 0) {
    for (const pid_t client : clients)
      require(waitpid(client, nullptr, WNOHANG) == 0, "a client has ended");
    require(std::chrono::steady_clock::now() < until, std::to_string(without()) + " of " +
                                                          std::to_string(clients.size()) +
                                                          " clients receive no images");
    std::this_thread::sleep_for(100ms);
  }
}

std::uint64_t lost_by(const Settings& settings) {
  std::uint64_t out = 0;
  for (const ImageCounts& it : settings.shared->readers)
    out += it.lost;
  return out;
}

Figure measure(Settings& settings, Way way, std::size_t readers) {
  ++settings.domain;
  settings.shared->written = 0;
  for (ImageCounts& it : settings.shared->readers)
    it.received = it.lost = 0;
  const pid_t writer = start_process([&] {
    use_first_processor();
    way == Way::bare ? run_bare(settings) : run_gateway(settings, way == Way::multicast);
  });
  std::vector<pid_t> clients;
  for (std::size_t i = 0; i < readers; ++i) {
    clients.push_back(start_process([&] { run_reader(settings, i, way == Way::multicast); }));
    std::this_thread::sleep_for(20ms);
  }
  await_readers(settings, clients);
  std::this_thread::sleep_for(7s);  // announcements at the start
  const std::uint64_t lost = lost_by(settings);
  std::vector<double> costs;
  for (int i = 0; i < kWindows; ++i) {
    const double before = processor_time(writer);
    const std::uint64_t first = settings.shared->written;
    std::this_thread::sleep_for(kWindow);
    const std::uint64_t written = settings.shared->written - first;
    require(written != 0, "no image was written");
    costs.push_back((processor_time(writer) - before) / static_cast<double>(written));
  }
  const Figure out{median(costs), lost_by(settings) - lost};
  for (const pid_t client : clients)
    end_process(client);
  end_process(writer);
  return out;
}

// The network of the writer is that of this process, with the address 10.78.0.1.
pid_t make_networks() {
  require(::unshare(CLONE_NEWNET) == 0, "no network namespace: run as root");
  std::array<int, 2> ready{};
  require(::pipe2(ready.data(), O_CLOEXEC) == 0, "no pipe");
  const pid_t hosts = start_process([&] {
    require(::unshare(CLONE_NEWNET | CLONE_NEWNS) == 0 && ::write(ready[1], "x", 1) == 1,
            "no namespace");
    ::pause();
  });
  char octet = 0;
  require(::read(ready[0], &octet, 1) == 1, "no namespace");
  const std::string in = "nsenter -t " + std::to_string(hosts) + " -n ip ";
  command("ip link set lo up");
  command("ip link add eth0 type veth peer name eth0 netns " + std::to_string(hosts));
  command("ip address add 10.78.0.1/24 dev eth0 && ip link set eth0 up");
  command(in + "link set lo up");
  command(in + "address add 10.78.0.2/24 dev eth0");
  command(in + "link set eth0 up");
  // What the kernel does to deliver to the clients is the work of other hosts: on the second
  // processor, while the writer has the first one. Otherwise it counts as processor time of the
  // writer, in whose system call it is done.
  command("nsenter -t " + std::to_string(hosts) +
          " -n -m sh -c 'mount --make-rprivate / && mount -t sysfs none /sys && "
          "echo 2 > /sys/class/net/eth0/queues/rx-0/rps_cpus'");
  std::this_thread::sleep_for(2s);  // until the interfaces run: the library reads them once
  return hosts;
}

// The profiles, with fewer announcements at the start: a hundred programs start together.
std::string make_profiles() {
  std::string text(dds::built_in_profiles());
  const std::string before = "<count>50</count>";
  const std::size_t at = text.find(before);
  require(at != std::string::npos, "the profiles have changed");
  text.replace(at, before.size(), "<count>8</count>");
  std::string file = "/tmp/fan-out-" + std::to_string(getpid()) + ".xml";
  std::ofstream(file) << text;
  return file;
}

void print(std::size_t clients, const std::array<Figure, 3>& figures) {
  const std::string of = std::to_string(clients) + (clients == 1 ? " client, " : " clients, ");
  constexpr std::array<const char*, 3> kNames{"bare writer, reliable unicast", "gateway",
                                              "gateway with fan_out: multicast"};
  for (std::size_t i = 0; i < figures.size(); ++i) {
    std::printf("  %-46s%8.1f us %6.2f x   %llu images lost\n", (of + kNames[i]).c_str(),
                figures[i].cost, figures[i].cost / figures[0].cost,
                static_cast<unsigned long long>(figures[i].lost));
  }
  if (clients != 50)
    return;
  print_target("50 clients, gateway", figures[1].cost / figures[0].cost, 0.8, "x unicast");
  print_target("50 clients, fan_out: multicast", figures[2].cost / figures[0].cost, 0.35,
               "x unicast");
}

int run(const std::vector<std::size_t>& counts) {
  // Domains up to 100: the ports of higher ones are among those that the system gives to sockets
  // for sending, of which 100 clients have hundreds. All programs are in networks of their own.
  Settings settings{make_profiles(), 0, &make_shared_with_children<Shared>(), make_networks()};
  print_heading("processor time of the writer for an image of 512 octets every 10 ms");
  for (const std::size_t count : counts) {
    std::array<Figure, 3> figures;
    for (const Way way : {Way::bare, Way::unicast, Way::multicast})
      figures[static_cast<std::size_t>(way)] = measure(settings, way, count);
    print(count, figures);
  }
  end_process(settings.hosts);
  std::remove(settings.profiles.c_str());
  return 0;
}

}  // namespace
}  // namespace linegate::bench

// Arguments: numbers of clients instead of 1, 10 and 50.
int main(int argc, char** argv) {
  using namespace linegate::bench;
  std::setvbuf(stdout, nullptr, _IOLBF, 0);
  std::vector<std::size_t> counts;
  for (int i = 1; i < argc; ++i)
    counts.push_back(std::strtoul(argv[i], nullptr, 10));
  if (counts.empty())
    counts.assign(kReaders.begin(), kReaders.end());
  return run(counts);
}
