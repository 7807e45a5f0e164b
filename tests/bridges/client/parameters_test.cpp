// SPDX-License-Identifier: Apache-2.0
// Each number that a typed command has: values at both ends of its range are sent, in C++ and in C,
// and others are refused at once, with the parameter and its range in the text. None is cut to the
// width that it has in the request. checks.typed_commands compares the rows with linegate.h.
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "bridges/client/c_api.h"
#include "bridges/client/commands.h"

#include "fake_link.h"

namespace linegate::client {
namespace {

using namespace std::chrono_literals;

constexpr int kPatience = 1000;
constexpr const char* kTwoInC = "\7\7";
const Bytes kTwoSevens(2, std::byte{7});
const linegate_lss_address kLssAddress{.vendor = 1, .product = 2, .revision = 3, .serial = 4};

struct NumberRow {
  const char* command;
  const char* parameter;
  const char* range;  // in words
  std::uint64_t lowest;
  std::uint64_t highest;
  std::function<Call(const Line&, const Commands&, unsigned)> in_cpp;
  std::function<int(linegate_client*, int, unsigned)> in_c;
};

ListedObject object_with(unsigned index, unsigned sub, unsigned access) {
  return {.index = static_cast<std::uint16_t>(index),
          .sub = static_cast<std::uint8_t>(sub),
          .type = 6,
          .access = static_cast<std::uint8_t>(access),
          .name = "Speed",
          .value = kTwoSevens};
}
int create_in_c(linegate_client* client, int line, unsigned index, unsigned sub, unsigned access,
                std::int64_t byte) {
  linegate_object object{};
  object.size = sizeof object;
  object.index = static_cast<std::uint16_t>(index);
  object.sub = static_cast<std::uint8_t>(sub);
  object.access = static_cast<std::uint8_t>(access);
  object.type = 6;
  object.name = "Speed";
  object.value = kTwoInC;
  object.length = 2;
  return linegate_create_object(client, line, &object, byte, kPatience);
}
int journal_in_c(linegate_client* client, int line, unsigned node, unsigned severity) {
  linegate_journal_query query{};
  query.size = sizeof query;
  query.flags = LINEGATE_JOURNAL_NODE;
  query.node = static_cast<std::uint8_t>(node);
  query.severity = static_cast<std::uint8_t>(severity);
  return linegate_read_journal(client, line, &query, kPatience);
}

// The call with a number `v`.
#define CPP(call)                                                                                  \
  []([[maybe_unused]] const Line& line, [[maybe_unused]] const Commands& to, unsigned v) -> Call { \
    return call;                                                                                   \
  }
#define C(call) [](linegate_client* client, int line, unsigned v) -> int { return call; }

const char* const kOneNodeRange = "1..127";
const char* const kNodeOr0Range = "0..127";
const char* const kWordRange = "0..FFFFh";
const char* const kByteRange = "0..255";
const char* const kIdentifierRange = "0..1FFFFFFFh";

// One line a row.
// clang-format off
const std::vector<NumberRow> kNumbersOfObjects{
    {"sdo_read", "node", kOneNodeRange, 1, 127, CPP(line.sdo_read(v, 1, 0)), C(linegate_sdo_read(client, line, v, 1, 0, kPatience))},
    {"sdo_read", "index", kWordRange, 0, 0xFFFF, CPP(line.sdo_read(1, v, 0)), C(linegate_sdo_read(client, line, 1, v, 0, kPatience))},
    {"sdo_read", "sub", kByteRange, 0, 0xFF, CPP(line.sdo_read(1, 1, v)), C(linegate_sdo_read(client, line, 1, 1, v, kPatience))},
    {"sdo_write", "node", kOneNodeRange, 1, 127, CPP(line.sdo_write(v, 1, 0, kTwoSevens)), C(linegate_sdo_write(client, line, v, 1, 0, kTwoInC, 2, kPatience))},
    {"sdo_write", "index", kWordRange, 0, 0xFFFF, CPP(line.sdo_write(1, v, 0, kTwoSevens)), C(linegate_sdo_write(client, line, 1, v, 0, kTwoInC, 2, kPatience))},
    {"sdo_write", "sub", kByteRange, 0, 0xFF, CPP(line.sdo_write(1, 1, v, std::uint16_t{7})), C(linegate_sdo_write(client, line, 1, 1, v, kTwoInC, 2, kPatience))},
    {"nmt", "node", kNodeOr0Range, 0, 127, CPP(line.nmt(v, 1)), C(linegate_nmt(client, line, v, 1, kPatience))},
    {"nmt", "command", "1, 2, 128, 129 or 130", 1, 130, CPP(line.nmt(1, v)), C(linegate_nmt(client, line, 1, v, kPatience))},
    {"write_object", "node", kOneNodeRange, 1, 127, CPP(to.write_object(v, 1, 0, kTwoSevens)), C(linegate_write_object(client, line, v, 1, 0, kTwoInC, 2, 0, kPatience))},
    {"write_object", "index", kWordRange, 0, 0xFFFF, CPP(to.write_object(1, v, 0, kTwoSevens)), C(linegate_write_object(client, line, 1, v, 0, kTwoInC, 2, 0, kPatience))},
    {"write_object", "sub", kByteRange, 0, 0xFF, CPP(to.write_object(1, 1, v, kTwoSevens)), C(linegate_write_object(client, line, 1, 1, v, kTwoInC, 2, 0, kPatience))},
    {"read_network", "network", "1..65535", 1, 0xFFFF, CPP(to.read_network(v, 1, 1, 0)), C(linegate_read_network(client, line, v, 1, 1, 0, kPatience))},
    {"read_network", "node", kOneNodeRange, 1, 127, CPP(to.read_network(1, v, 1, 0)), C(linegate_read_network(client, line, 1, v, 1, 0, kPatience))},
    {"read_network", "index", kWordRange, 0, 0xFFFF, CPP(to.read_network(1, 1, v, 0)), C(linegate_read_network(client, line, 1, 1, v, 0, kPatience))},
    {"read_network", "sub", kByteRange, 0, 0xFF, CPP(to.read_network(1, 1, 1, v)), C(linegate_read_network(client, line, 1, 1, 1, v, kPatience))},
    {"write_network", "network", "1..65535", 1, 0xFFFF, CPP(to.write_network(v, 1, 1, 0, kTwoSevens)), C(linegate_write_network(client, line, v, 1, 1, 0, kTwoInC, 2, kPatience))},
    {"write_network", "node", kOneNodeRange, 1, 127, CPP(to.write_network(1, v, 1, 0, kTwoSevens)), C(linegate_write_network(client, line, 1, v, 1, 0, kTwoInC, 2, kPatience))},
    {"write_network", "index", kWordRange, 0, 0xFFFF, CPP(to.write_network(1, 1, v, 0, kTwoSevens)), C(linegate_write_network(client, line, 1, 1, v, 0, kTwoInC, 2, kPatience))},
    {"write_network", "sub", kByteRange, 0, 0xFF, CPP(to.write_network(1, 1, 1, v, kTwoSevens)), C(linegate_write_network(client, line, 1, 1, 1, v, kTwoInC, 2, kPatience))},
    {"read_own", "index", kWordRange, 0, 0xFFFF, CPP(to.read_own(v, 0)), C(linegate_read_own(client, line, v, 0, 0, kPatience))},
    {"read_own", "sub", kByteRange, 0, 0xFF, CPP(to.read_own(1, v)), C(linegate_read_own(client, line, 1, v, 0, kPatience))},
    {"read_own", "node", kNodeOr0Range, 0, 127, CPP(to.read_own(1, 0, v)), C(linegate_read_own(client, line, 1, 0, v, kPatience))},
    {"write_own", "index", kWordRange, 0, 0xFFFF, CPP(to.write_own(v, 0, kTwoSevens)), C(linegate_write_own(client, line, v, 0, kTwoInC, 2, 0, 0, kPatience))},
    {"write_own", "sub", kByteRange, 0, 0xFF, CPP(to.write_own(1, v, kTwoSevens)), C(linegate_write_own(client, line, 1, v, kTwoInC, 2, 0, 0, kPatience))},
    {"write_own", "node", kNodeOr0Range, 0, 127, CPP(to.write_own(1, 0, kTwoSevens, v)), C(linegate_write_own(client, line, 1, 0, kTwoInC, 2, v, 0, kPatience))},
    {"list_objects", "first", kWordRange, 0, 0xFFFF, CPP(to.list_objects(v)), C(linegate_list_objects(client, line, v, 0xFFFF, 0, kPatience))},
    {"list_objects", "last", kWordRange, 0, 0xFFFF, CPP(to.list_objects(0, v)), C(linegate_list_objects(client, line, 0, v, 0, kPatience))},
    {"list_objects", "node", kNodeOr0Range, 0, 127, CPP(to.list_objects(0, 0xFFFF, v)), C(linegate_list_objects(client, line, 0, 0xFFFF, v, kPatience))},
    {"remove_object", "index", "2000h..5EFFh or 6000h..9FFFh", 0x2000, 0x9FFF, CPP(to.remove_object(v)), C(linegate_remove_object(client, line, v, kPatience))},
};
const std::vector<NumberRow> kNumbersOfNodes{
    {"scan", "node", kNodeOr0Range, 0, 127, CPP(to.scan(v)), C(linegate_scan(client, line, v, kPatience))},
    {"apply_scan", "node", kNodeOr0Range, 0, 127, CPP(to.apply_scan(v)), C(linegate_apply_scan(client, line, v, 0, 0, kPatience))},
    {"boot", "node", kNodeOr0Range, 0, 127, CPP(to.boot(v)), C(linegate_boot(client, line, v, kPatience))},
    {"compare", "node", kNodeOr0Range, 0, 127, CPP(to.compare(v)), C(linegate_compare(client, line, v, kPatience))},
    {"configure", "node", kNodeOr0Range, 0, 127, CPP(to.configure(v)), C(linegate_configure(client, line, v, kPatience))},
    {"program", "node", kOneNodeRange, 1, 127, CPP(to.program(v, 1, kTwoSevens)), C(linegate_program(client, line, v, 1, kTwoInC, 2, kPatience))},
    {"program", "number", "1..255", 1, 0xFF, CPP(to.program(1, v, kTwoSevens)), C(linegate_program(client, line, 1, v, kTwoInC, 2, kPatience))},
    {"lss_set_bit_timing", "table", kByteRange, 0, 0xFF, CPP(to.lss_set_bit_timing(v, 0)), C(linegate_lss_set_bit_timing(client, line, v, 0, kPatience))},
    {"lss_set_bit_timing", "index", kByteRange, 0, 0xFF, CPP(to.lss_set_bit_timing(0, v)), C(linegate_lss_set_bit_timing(client, line, 0, v, kPatience))},
    {"lss_activate_bit_timing", "delay", "0..65535 ms", 0, 0xFFFF, CPP(to.lss_activate_bit_timing(std::chrono::milliseconds(v))), C(linegate_lss_activate_bit_timing(client, line, v, kPatience))},
    {"lss_fastscan", "known", "0..15", 0, 15, CPP(to.lss_fastscan(v)), C(linegate_lss_fastscan(client, line, v, &kLssAddress, kPatience))},
    {"open_connection", "client", kOneNodeRange, 1, 127, CPP(to.open_connection(v, 1)), C(linegate_open_connection(client, line, v, 1, kPatience))},
    {"open_connection", "server", kOneNodeRange, 1, 127, CPP(to.open_connection(1, v)), C(linegate_open_connection(client, line, 1, v, kPatience))},
};
const std::vector<NumberRow> kNumbersOfFrames{
    {"trigger_pdo", "number", "1..65535", 1, 0xFFFF, CPP(to.trigger_pdo(v)), C(linegate_trigger_pdo(client, line, v, 0, kPatience))},
    {"trigger_pdo", "number", "1..512", 1, 512, CPP(to.trigger_pdo(v, 1)), C(linegate_trigger_pdo(client, line, v, 1, kPatience))},
    {"trigger_pdo", "node", kNodeOr0Range, 0, 127, CPP(to.trigger_pdo(1, v)), C(linegate_trigger_pdo(client, line, 1, v, kPatience))},
    {"request_pdo", "number", "1..65535", 1, 0xFFFF, CPP(to.request_pdo(0, v)), C(linegate_request_pdo(client, line, 0, v, kPatience))},
    {"request_pdo", "number", "1..512", 1, 512, CPP(to.request_pdo(1, v)), C(linegate_request_pdo(client, line, 1, v, kPatience))},
    {"request_pdo", "node", kNodeOr0Range, 0, 127, CPP(to.request_pdo(v, 1)), C(linegate_request_pdo(client, line, v, 1, kPatience))},
    {"write_mpdo", "node", kNodeOr0Range, 0, 127, CPP(to.write_mpdo(v, 1, 0, kTwoSevens)), C(linegate_write_mpdo(client, line, v, 1, 0, kTwoInC, 2, 0, kPatience))},
    {"write_mpdo", "index", kWordRange, 0, 0xFFFF, CPP(to.write_mpdo(1, v, 0, kTwoSevens)), C(linegate_write_mpdo(client, line, 1, v, 0, kTwoInC, 2, 0, kPatience))},
    {"write_mpdo", "sub", kByteRange, 0, 0xFF, CPP(to.write_mpdo(1, 1, v, kTwoSevens)), C(linegate_write_mpdo(client, line, 1, 1, v, kTwoInC, 2, 0, kPatience))},
    {"write_mpdo", "tpdo", "0..512", 0, 512, CPP(to.write_mpdo(1, 1, 0, kTwoSevens, v)), C(linegate_write_mpdo(client, line, 1, 1, 0, kTwoInC, 2, v, kPatience))},
    {"send_emcy", "code", kWordRange, 0, 0xFFFF, CPP(to.send_emcy(v, 1)), C(linegate_send_emcy(client, line, v, 1, nullptr, 0, kPatience))},
    {"send_emcy", "error_register", kByteRange, 0, 0xFF, CPP(to.send_emcy(0x1000, v)), C(linegate_send_emcy(client, line, 0x1000, v, nullptr, 0, kPatience))},
    {"send_emcy", "node", kNodeOr0Range, 0, 127, CPP(to.send_emcy(0x1000, 1, {}, v)), C(linegate_send_emcy(client, line, 0x1000, 1, nullptr, v, kPatience))},
    {"send_frame", "identifier", "0..7FFh", 0, 0x7FF, CPP(to.send_frame(v, kTwoSevens)), C(linegate_send_frame(client, line, v, kTwoInC, 2, 0, kPatience))},
    {"send_frame", "identifier", kIdentifierRange, 0, 0x1FFF'FFFF, CPP(to.send_frame(v, kTwoSevens, true)), C(linegate_send_frame(client, line, v, kTwoInC, 2, LINEGATE_EXTENDED, kPatience))},
    {"send_remote_frame", "identifier", "0..7FFh", 0, 0x7FF, CPP(to.send_remote_frame(v, 0)), C(linegate_send_remote_frame(client, line, v, 0, 0, kPatience))},
    {"send_remote_frame", "identifier", kIdentifierRange, 0, 0x1FFF'FFFF, CPP(to.send_remote_frame(v, 0, true)), C(linegate_send_remote_frame(client, line, v, 0, 1, kPatience))},
    {"send_remote_frame", "length", "0..8", 0, 8, CPP(to.send_remote_frame(1, v)), C(linegate_send_remote_frame(client, line, 1, v, 0, kPatience))},
    {"listen", "seconds", "0..3600", 0, 3600, CPP(to.listen(std::chrono::seconds(v))), C(linegate_listen(client, line, v, 0, 0, -1, kPatience))},
    {"listen", "identifier", kIdentifierRange, 0, 0x1FFF'FFFF, CPP(to.listen(1s, v)), C(linegate_listen(client, line, 1, v, 0, -1, kPatience))},
    {"listen", "mask", kIdentifierRange, 0, 0x1FFF'FFFF, CPP(to.listen(1s, 0, v)), C(linegate_listen(client, line, 1, 0, v, -1, kPatience))},
    {"trace_routing", "seconds", "1..3600", 1, 3600, CPP(to.trace_routing(std::chrono::seconds(v))), C(linegate_trace_routing(client, line, v, kPatience))},
};
// Members of structs, as wide as in the request.
const std::vector<NumberRow> kNumbersOfStructs{
    {"create_object", "index", "2000h..5EFFh or 6000h..9FFFh", 0x2000, 0x9FFF, CPP(to.create_object(object_with(v, 0, 2))), C(create_in_c(client, line, v, 0, 2, -1))},
    {"create_object", "sub", "0..254", 0, 254, CPP(to.create_object(object_with(0x2000, v, 2))), C(create_in_c(client, line, 0x2000, v, 2, -1))},
    {"create_object", "access", "0..5", 0, 5, CPP(to.create_object(object_with(0x2000, 0, v))), C(create_in_c(client, line, 0x2000, 0, v, -1))},
    {"read_journal", "node", kNodeOr0Range, 0, 127, CPP(to.read_journal({.node = static_cast<std::uint8_t>(v)})), C(journal_in_c(client, line, v, 0))},
    {"read_journal", "severity", "0..2", 0, 2, CPP(to.read_journal({.severity = static_cast<std::uint8_t>(v)})), C(journal_in_c(client, line, 1, v))},
};
// clang-format on
#undef CPP
#undef C

struct Parameters : testing::Test {
  std::shared_ptr<FakeWorld> world = std::make_shared<FakeWorld>();
  Client same = fake_client(world);  // before the one in C: both receive what the world has then
  Line line_of_same = same.line("press");
  Commands press{line_of_same};
  linegate_client* client = adopt(fake_client(world));
  int line = linegate_line(client, "press");

  void SetUp() override {
    world->whole_line(1);
    same.poll(0ms);
    world->whole_line(1);
    ASSERT_EQ(linegate_poll(client, 0), LINEGATE_OK);
    ASSERT_TRUE(line_of_same.ready());
  }
  void TearDown() override { linegate_close(client); }

  std::uint64_t sent_by(const std::function<void()>& call) const {
    const std::uint64_t before = world->sent;
    call();
    return world->sent - before;
  }
  void expect_sent(const NumberRow& row, unsigned value) {
    EXPECT_EQ(sent_by([&] { EXPECT_FALSE(row.in_cpp(line_of_same, press, value).done()); }), 1U)
        << row.command << ' ' << row.parameter << ' ' << value;
    EXPECT_EQ(sent_by([&] { EXPECT_GT(row.in_c(client, line, value), 0); }), 1U)
        << row.command << ' ' << row.parameter << ' ' << value;
  }
  void expect_refused(const NumberRow& row, unsigned value) {
    const std::string where =
        std::string(row.command) + ' ' + row.parameter + ' ' + std::to_string(value);
    const std::string text = std::string(row.parameter) + " is not " + row.range;
    const auto refusal = static_cast<std::uint32_t>(line::Refusal::bad_request);
    EXPECT_EQ(sent_by([&] {
                const Call call = row.in_cpp(line_of_same, press, value);
                EXPECT_EQ(call.outcome(), Outcome::refused) << where;
                EXPECT_EQ(call.code(), refusal) << where;
                EXPECT_EQ(call.text(), text) << where;
                const int number = row.in_c(client, line, value);
                linegate_result result{};
                EXPECT_EQ(linegate_call_result(client, number, &result), LINEGATE_OK) << where;
                EXPECT_EQ(result.outcome, LINEGATE_REFUSED) << where;
                EXPECT_EQ(result.code, refusal) << where;
                EXPECT_EQ(result.text, text) << where;
              }),
              0U)
        << where;
  }
  // wide: a value that the width of the request would cut to one in the range.
  void check(const std::vector<NumberRow>& rows, bool wide = true) {
    for (const NumberRow& row : rows) {
      expect_sent(row, static_cast<unsigned>(row.lowest));
      expect_sent(row, static_cast<unsigned>(row.highest));
      if (row.lowest > 0)
        expect_refused(row, static_cast<unsigned>(row.lowest - 1));
      expect_refused(row, static_cast<unsigned>(row.highest + 1));
      for (const std::uint64_t cut : {0x100U, 0x1'0000U, 0x8000'0000U})
        if (wide && cut + row.lowest > row.highest)
          expect_refused(row, static_cast<unsigned>(cut + row.lowest));
    }
  }
};

TEST_F(Parameters, OfObjectsAreRefusedOutsideOfTheirRange) {
  check(kNumbersOfObjects);
}

TEST_F(Parameters, OfNodesAndLssAreRefusedOutsideOfTheirRange) {
  check(kNumbersOfNodes);
}

TEST_F(Parameters, OfPdosAndFramesAreRefusedOutsideOfTheirRange) {
  check(kNumbersOfFrames);
}

TEST_F(Parameters, OfStructsAreRefusedOutsideOfTheirRange) {
  check(kNumbersOfStructs, false);
}

TEST_F(Parameters, ANodeIdOfLssIsOneOfANodeOr255) {
  const NumberRow row{
      "lss_set_node_id",
      "node",
      "1..127 or 255",
      1,
      127,
      [](const Line&, const Commands& to, unsigned v) -> Call { return to.lss_set_node_id(v); },
      [](linegate_client* in_c, int of, unsigned v) {
        return linegate_lss_set_node_id(in_c, of, v, 1, kPatience);
      }};
  check({row});
  expect_sent(row, 255);
  expect_refused(row, 254);
}

TEST_F(Parameters, WithGapsInTheirRangeAreRefusedThere) {
  EXPECT_EQ(press.remove_object(0x5F00).text(), "index is not 2000h..5EFFh or 6000h..9FFFh");
  EXPECT_EQ(line_of_same.nmt(1, 3).text(), "command is not 1, 2, 128, 129 or 130");
  EXPECT_EQ(world->sent, 0U);
}

TEST_F(Parameters, OfBytesAreRefusedOutsideOfTheirLength) {
  const Bytes five(5);
  const std::string longer(257, 'x');
  EXPECT_EQ(press.write_mpdo(1, 1, 0, {}).text(), "value is not 1 to 4 bytes");
  EXPECT_EQ(press.write_mpdo(1, 1, 0, five).text(), "value is not 1 to 4 bytes");
  EXPECT_EQ(press.program(1, 1, {}).text(), "program is not 1 byte to 16 MiB");
  EXPECT_EQ(press.send_frame(1, Bytes(9)).text(), "data is not 0..8 bytes");
  EXPECT_EQ(press.send_frame(1, Bytes(9), false, true).text(),
            "data is not 0..8, 12, 16, 20, 24, 32, 48 or 64 bytes");
  EXPECT_EQ(press.send_frame(1, Bytes(12), false, false, true).text(), "data is not 0..8 bytes");
  EXPECT_EQ(press.send_frame(1, five, false, false, true).text(),
            "bit_rate_switch is not possible without fd");
  EXPECT_EQ(press.set_bus_faults(longer).text(), "faults is not 0..256 bytes");
  EXPECT_EQ(press.read_journal({.text = longer}).text(), "text is not 0..255 bytes");
  EXPECT_EQ(press.read_journal({.line = longer}).text(), "line is not 0..255 bytes");
  EXPECT_EQ(press.create_object({.index = 0x2000, .type = 5, .name = longer}).text(),
            "name is not 0..255 bytes");
  EXPECT_EQ(press.create_object(object_with(0x2000, 0, 2), 0x1'0000'0000).text(),
            "image_byte is not 0..FFFFFFFFh");
  EXPECT_EQ(world->sent, 0U);
}

TEST_F(Parameters, OfTimesThatAreNegativeOrTooLongAreRefused) {
  EXPECT_EQ(press.lss_activate_bit_timing(-1ms).text(), "delay is not 0..65535 ms");
  EXPECT_EQ(press.lss_activate_bit_timing(std::chrono::milliseconds::max()).text(),
            "delay is not 0..65535 ms");
  EXPECT_EQ(press.listen(-1s).text(), "seconds is not 0..3600");
  EXPECT_EQ(press.listen(std::chrono::seconds::max()).text(), "seconds is not 0..3600");
  EXPECT_EQ(press.trace_routing(std::chrono::seconds::min()).text(), "seconds is not 1..3600");
  EXPECT_EQ(world->sent, 0U);
}

}  // namespace
}  // namespace linegate::client
