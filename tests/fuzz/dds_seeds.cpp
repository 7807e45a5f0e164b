// SPDX-License-Identifier: Apache-2.0
// Writes the inputs of the target dds_samples to the folder: valid samples of every topic, small
// and larger ones, in both byte orders, with related samples in one file. They are kept in
// corpus/dds_samples.
//
// usage: dds_seeds FOLDER
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include <fastcdr/Cdr.h>
#include <linegate.h>

#include "bridges/dds/command_samples.h"
#include "bridges/dds/event_samples.h"
#include "bridges/dds/image_samples.h"
#include "bridges/dds/output_samples.h"
#include "bridges/dds/output_state_samples.h"
#include "bridges/dds/state_samples.h"
#include "bridges/request/journal.h"

#include "tests/dds/known_values.h"
#include "tests/fuzz/dds_input.h"

namespace {

using namespace linegate;
using namespace linegate::dds;
using eprosima::fastcdr::Cdr;
using fuzz::Topic;

class Seed {
 public:
  explicit Seed(Cdr::Endianness order = Cdr::LITTLE_ENDIANNESS) : order_(order) {}

  template <class Sample>
  Seed& add(Topic topic, const Sample& sample) {
    std::string octets(65'535, '\0');  // zeros where CDR leaves gaps: the same in every run
    eprosima::fastcdr::FastBuffer buffer(octets.data(), octets.size());
    Cdr cdr(buffer, order_, Cdr::DDS_CDR);
    cdr.serialize_encapsulation();
    sample.serialize(cdr);
    const std::size_t length = cdr.getSerializedDataLength();
    octets_ += static_cast<char>(topic);
    octets_ += static_cast<char>(length & 0xFFU);
    octets_ += static_cast<char>(length >> 8U);
    octets_.append(octets, 0, length);
    return *this;
  }

  // Replaces the octet at that offset; a negative offset counts from the end.
  Seed& spoil(std::ptrdiff_t at, char octet) {
    octets_[static_cast<std::size_t>(at < 0 ? std::ssize(octets_) + at : at)] = octet;
    return *this;
  }

  void save(const std::filesystem::path& file) const {
    std::ofstream(file, std::ios::binary) << octets_;
  }

 private:
  Cdr::Endianness order_;
  std::string octets_;
};

template <class Sample>
Sample addressed() {
  Sample sample;
  sample.gateway(fuzz::kGateway);
  sample.line(fuzz::kLine);
  sample.incarnation(fuzz::kIncarnation);
  return sample;
}

v1::LineState line_state() {
  auto sample = addressed<v1::LineState>();
  to_wire(known::line_info(), known::line_state(), sample);
  to_wire(known::properties(), sample.properties());
  return sample;
}

v1::GatewayState gateway_state() {
  v1::GatewayState sample;
  sample.gateway(fuzz::kGateway);
  sample.incarnation(fuzz::kIncarnation);
  to_wire(known::gateway_info(), known::clock(), sample);
  return sample;
}

v1::NodeState node_state() {
  auto sample = addressed<v1::NodeState>();
  to_wire(known::node_info(), known::node_state(), known::clock(), sample);
  to_wire(known::properties(), sample.properties());
  return sample;
}

v1::Event event() {
  auto sample = addressed<v1::Event>();
  to_wire(known::event(3), known::event_text(3), known::clock(), sample);
  to_wire(known::properties(), sample.properties());
  return sample;
}

// The first `entries` entries of the known layout, divided into parts.
std::vector<v1::ImageLayout> layout_parts(std::uint32_t entries, std::uint16_t parts) {
  image::Layout layout = known::layout();
  layout.entries.resize(entries);
  layout.byte_size = entries * 2;
  v1::ImageLayout whole = addressed<v1::ImageLayout>();
  to_wire(layout, 0, whole);
  std::vector<v1::ImageLayout> out;
  for (std::uint16_t part = 0; part < parts; ++part) {
    const std::uint32_t begin = entries * part / parts;
    const std::uint32_t end = entries * (part + 1U) / parts;
    v1::ImageLayout& sample = out.emplace_back(whole);
    sample.part(part);
    sample.parts(parts);
    sample.first_entry(begin);
    sample.entries({whole.entries().begin() + begin, whole.entries().begin() + end});
  }
  return out;
}

image::Snapshot snapshot(std::uint32_t entries) {
  image::Snapshot snapshot = known::snapshot();
  snapshot.bytes.resize(std::size_t{entries} * 2);
  return snapshot;
}

v1::ProcessImage process_image(std::uint32_t entries) {
  auto sample = addressed<v1::ProcessImage>();
  to_wire(snapshot(entries), known::clock(), sample);
  return sample;
}

v1::PdoUpdate pdo_update() {
  auto sample = addressed<v1::PdoUpdate>();
  const image::Snapshot image = known::snapshot();
  to_wire(known::layout(), image, image.marks[0], 3, known::clock(), sample);
  return sample;
}

v1::PdoReception pdo_reception() {
  auto sample = addressed<v1::PdoReception>();
  to_wire(known::layout(), known::reception(), known::clock(), sample);
  return sample;
}

v1::OutputState output_state() {
  auto sample = addressed<v1::OutputState>();
  to_wire(known::output_state(), known::clock(), known::at(4), sample);
  return sample;
}

v1::OutputWrite output_write(std::size_t values, std::size_t run) {
  line::OutputWrite write;
  write.group = 3;
  write.layout_id = 4;
  write.arming = 5;
  write.watchdog = std::chrono::milliseconds(100);
  write.reactions = line::kZeroOutputs | line::kNmtStop;
  for (std::uint32_t i = 0; i < values; ++i) {
    write.values.push_back({i, static_cast<std::uint8_t>(1 + i % 8), {}});
  }
  if (run != 0)
    write.bytes.push_back({16, known::pattern(run, 3)});
  auto sample = addressed<v1::OutputWrite>();
  to_wire(write, sample);
  sample.client(fuzz::kClient);
  return sample;
}

v1::CommandRequest command_request(std::uint64_t id, line::CommandKind kind, std::size_t bytes) {
  auto sample = addressed<v1::CommandRequest>();
  sample.kind(static_cast<std::uint8_t>(kind));
  sample.node(5);
  sample.index(0x1018);
  sample.sub(1);
  sample.nmt(v1::NMT_START);
  if (kind == line::CommandKind::network_read || kind == line::CommandKind::network_write)
    sample.code(3);
  sample.client(fuzz::kClient);
  sample.id(id);
  set_chunk(known::pattern(bytes, 1), 0, sample);
  return sample;
}

// A chunk of an SDO download of 30 bytes.
v1::CommandRequest chunk(std::uint64_t id, std::uint32_t offset, std::size_t bytes) {
  v1::CommandRequest sample = command_request(id, line::CommandKind::sdo_write, bytes);
  sample.offset(offset);
  sample.last(offset + bytes == 30);
  return sample;
}

v1::CommandReply reply(std::uint64_t id, std::uint32_t offset, std::size_t bytes, bool last) {
  auto sample = addressed<v1::CommandReply>();
  sample.client(fuzz::kClient);
  sample.id(id);
  sample.total(40);
  set_chunk(known::pattern(bytes, 2), 0, sample);
  sample.offset(offset);
  sample.last(last);
  return sample;
}

Seed every_topic(Cdr::Endianness order) {
  Seed seed(order);
  seed.add(Topic::line_state, line_state()).add(Topic::node_state, node_state());
  seed.add(Topic::image_layout, layout_parts(3, 1)[0]);
  seed.add(Topic::process_image, process_image(3)).add(Topic::pdo_update, pdo_update());
  seed.add(Topic::event, event()).add(Topic::output_write, output_write(2, 4));
  seed.add(Topic::command_request, command_request(1, line::CommandKind::sdo_read, 0));
  seed.add(Topic::gateway_state, gateway_state());
  seed.add(Topic::output_state, output_state()).add(Topic::pdo_reception, pdo_reception());
  return seed.add(Topic::command_reply, reply(1, 0, 4, true));
}

Seed nothing_in_any() {
  Seed seed;
  seed.add(Topic::line_state, v1::LineState()).add(Topic::node_state, v1::NodeState());
  seed.add(Topic::image_layout, v1::ImageLayout()).add(Topic::process_image, v1::ProcessImage());
  seed.add(Topic::pdo_update, v1::PdoUpdate()).add(Topic::event, v1::Event());
  seed.add(Topic::output_write, v1::OutputWrite());
  seed.add(Topic::command_request, v1::CommandRequest());
  seed.add(Topic::gateway_state, v1::GatewayState());
  seed.add(Topic::output_state, v1::OutputState()).add(Topic::pdo_reception, v1::PdoReception());
  return seed.add(Topic::command_reply, v1::CommandReply());
}

Seed layout_and_image() {
  Seed seed;
  for (const v1::ImageLayout& part : layout_parts(12, 3))
    seed.add(Topic::image_layout, part);
  return seed.add(Topic::process_image, process_image(12));
}

// Each kind of command, the first one twice, and the rest of its answer.
Seed commands() {
  Seed seed;
  seed.add(Topic::command_request, command_request(1, line::CommandKind::sdo_write, 30));
  seed.add(Topic::command_request, command_request(1, line::CommandKind::sdo_write, 30));
  v1::CommandRequest rest = command_request(1, line::CommandKind::sdo_write, 0);
  rest.reply_offset(10);
  seed.add(Topic::command_request, rest);
  for (unsigned kind = 0; kind <= v1::COMMAND_NETWORK_WRITE; ++kind) {
    const auto as = static_cast<line::CommandKind>(kind);
    const bool writes =
        as == line::CommandKind::sdo_write || as == line::CommandKind::local_write ||
        as == line::CommandKind::network_write || as == line::CommandKind::output_write;
    seed.add(Topic::command_request, command_request(2 + kind, as, writes ? 2 : 0));
  }
  return seed;
}

// Requests for stored events and values, with each condition, within the limit of the target.
Seed journal_reads() {
  const auto time = [](std::int64_t ns) { return Instant(Duration(ns)); };
  const request::JournalRead events{.line = fuzz::kLine,
                                    .node = 5,
                                    .kind = EventKind::emcy,
                                    .least = EventSeverity::warning,
                                    .text = "w",
                                    .since = time(1),
                                    .until = time(2),
                                    .after = request::EventPosition{3, 4},
                                    .most = 10};
  const request::JournalRead values{.line = fuzz::kLine,
                                    .node = 5,
                                    .text = "a*",
                                    .since = time(1),
                                    .until = time(2),
                                    .cursor = {6, 7},
                                    .newest_first = true,
                                    .values = true};
  Seed seed;
  std::uint64_t id = 1;
  for (const request::JournalRead& read : {events, values}) {
    auto sample = addressed<v1::CommandRequest>();
    sample.kind(v1::COMMAND_JOURNAL_READ);
    sample.entry(read.most);
    sample.client(fuzz::kClient);
    sample.id(id++);
    set_chunk(encode(read), 0, sample);
    seed.add(Topic::command_request, sample);
  }
  return seed;
}

Seed chunks() {
  Seed seed;
  for (const std::uint64_t id : {1U, 2U})
    seed.add(Topic::command_request, chunk(id, 0, 10));
  for (const std::uint32_t offset : {10U, 20U})
    seed.add(Topic::command_request, chunk(1, offset, 10));
  return seed.add(Topic::command_request, chunk(2, 20, 10));  // one chunk is missing
}

Seed replies() {
  Seed seed;
  for (std::uint32_t offset = 0; offset < 40; offset += 10)
    seed.add(Topic::command_reply, reply(2, offset, 10, offset == 30));
  auto refused = reply(1, 0, 0, true);
  refused.domain(v1::RESULT_REFUSED);
  refused.code(v1::REFUSAL_BAD_REQUEST);
  refused.text("a chunk is missing");
  return seed.add(Topic::command_reply, refused).add(Topic::command_reply, reply(3, 5, 5, true));
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: %s FOLDER\n", argv[0]);
    return 1;
  }
  const std::filesystem::path folder = argv[1];
  std::filesystem::create_directories(folder);
  every_topic(Cdr::LITTLE_ENDIANNESS).save(folder / "every-topic");
  every_topic(Cdr::BIG_ENDIANNESS).save(folder / "every-topic-big-endian");
  nothing_in_any().save(folder / "nothing-in-any");
  layout_and_image().save(folder / "layout-and-image");
  Seed().add(Topic::output_write, output_write(0, 0)).save(folder / "outputs-none");
  Seed().add(Topic::output_write, output_write(40, 500)).save(folder / "outputs-many");
  Seed().add(Topic::process_image, process_image(300)).save(folder / "image-larger");
  commands().save(folder / "commands");
  journal_reads().save(folder / "journal-reads");
  chunks().save(folder / "chunks");
  replies().save(folder / "replies");
  const v1::CommandRequest good = command_request(1, line::CommandKind::sdo_read, 0);
  const auto spoilt = [&] { return Seed().add(Topic::command_request, good); };
  spoilt().spoil(-8, 2).save(folder / "boolean-neither-true-nor-false");
  spoilt().spoil(-4, 9).save(folder / "octets-that-are-not-there");
  spoilt().spoil(4, 0x77).save(folder / "unknown-encapsulation");
  return 0;
}
