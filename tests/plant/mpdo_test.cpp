// SPDX-License-Identifier: Apache-2.0
// MPDOs between a manager and a simulated device, and PDOs that are requested with a remote frame.
#include "stack/pdo/mpdo.h"

#include <algorithm>
#include <cstdint>
#include <utility>
#include <vector>

#include "stack/can/cob_id.h"

#include "tests/plant/manager_fixture.h"

namespace linegate::plant {
namespace {

using od::DataType;

constexpr std::uint8_t kDevice = 5;
constexpr std::uint8_t kOwn = 127;
constexpr std::uint32_t kToDevice = 0x57E;    // destination address mode
constexpr std::uint32_t kFromDevice = 0x57D;  // source address mode
constexpr std::uint32_t kFromOwn = 0x57C;     // source address mode
constexpr od::Address kGiven{0x2F01, 0};      // of the device: received and sent by MPDO
constexpr od::Address kFollows{0x2F02, 0};    // of the device: received from the own node
constexpr std::uint16_t kOwnObject = 0x2100;

od::VariableDescription variable_of(std::uint8_t sub, DataType type, std::uint64_t value) {
  od::VariableDescription out;
  out.sub = sub;
  out.type = type;
  out.access = od::Access::rw;
  out.mappable = true;
  out.value.resize(od::byte_size(type));
  store_le(std::span(out.value), value);
  return out;
}

void add_object(od::Dictionary& to, std::uint16_t index, std::vector<std::uint64_t> values,
                DataType type) {
  od::ObjectDescription object{.index = index, .name = "Record", .type = od::ObjectType::record};
  object.variables.push_back(variable_of(0, DataType::unsigned8, values.size()));
  for (std::uint8_t sub = 1; sub <= values.size(); ++sub) {
    object.variables.push_back(variable_of(sub, type, values[sub - 1]));
  }
  ASSERT_TRUE(to.add(object).ok());
}

void add_value(od::Dictionary& to, od::Address address) {
  od::ObjectDescription object{.index = address.index, .name = "Value"};
  object.variables.push_back(variable_of(0, DataType::unsigned32, 0));
  ASSERT_TRUE(to.add(object).ok());
}

// Adds the communication record at that index, and its mapping record.
void add_mpdo(od::Dictionary& to, std::uint16_t index, std::uint32_t id, pdo::MpdoMode mode) {
  od::ObjectDescription record{.index = index, .name = "PDO", .type = od::ObjectType::record};
  record.variables = {variable_of(0, DataType::unsigned8, 2),
                      variable_of(1, DataType::unsigned32, id),
                      variable_of(2, DataType::unsigned8, 254)};
  ASSERT_TRUE(to.add(record).ok());
  record.index = static_cast<std::uint16_t>(index + 0x200);
  record.variables = {
      variable_of(0, DataType::unsigned8, mode == pdo::MpdoMode::source ? 254 : 255),
      variable_of(1, DataType::unsigned32, 0)};
  ASSERT_TRUE(to.add(record).ok());
}

pdo::Parameters own_mpdo(std::uint16_t number, std::uint32_t id, pdo::MpdoMode mode) {
  pdo::Parameters out;
  out.number = number;
  out.cob_id = {id | can::CobId::kNoRtrBit};
  out.mpdo = mode;
  return out;
}

// 2100h:1 is sent by the MPDOs of commands, :2 receives 2F01h of the device (in the inputs of the
// image), :3 is sent to 2F02h of the device (in the outputs).
line::OwnObject own_object(std::uint8_t sub, od::Access access) {
  line::OwnObject out{.index = kOwnObject, .variable = variable_of(sub, DataType::unsigned32, 0)};
  out.variable.access = access;
  out.in_image = sub > 1;
  return out;
}

class MpdoTest : public ManagerFixture {
 protected:
  void SetUp() override {
    config().own_objects = {own_object(1, od::Access::rw), own_object(2, od::Access::rww),
                            own_object(3, od::Access::ro)};
    auto& own = config().forwarding;
    own.tpdos = {own_mpdo(100, kToDevice, pdo::MpdoMode::destination),
                 own_mpdo(101, kFromOwn, pdo::MpdoMode::source)};
    own.tpdos[0].mapping = {{{kOwnObject, 1}, 32}};
    own.rpdos = {own_mpdo(101, kFromDevice, pdo::MpdoMode::source)};
    config().mpdo_scanner = {0x01'2100'03};
    config().mpdo_dispatcher = {0x01'2100'02'2F01'00'00 | kDevice};
    line::NodeConfig node = node_of(kDevice, "encoder");
    permit_rtr(node);
    add(std::move(node), "encoder");
  }
  void prepare(sim::Device& made) override {
    device_ = &made;
    od::Dictionary& dictionary = made.dictionary();
    add_value(dictionary, kGiven);
    add_value(dictionary, kFollows);
    add_mpdo(dictionary, 0x1407, kToDevice, pdo::MpdoMode::destination);
    add_mpdo(dictionary, 0x1408, kFromOwn, pdo::MpdoMode::source);
    add_mpdo(dictionary, 0x1807, kFromDevice, pdo::MpdoMode::source);
    add_object(dictionary, 0x1FA0, {0x01'2F01'00}, DataType::unsigned32);
    add_object(dictionary, 0x1FD0, {0x01'2F02'00'2100'03'00ULL | kOwn}, DataType::unsigned64);
    made.node().pdos().set_auto_notify(0x1807 - 0x1800 + 1, true);
  }
  std::uint64_t of_device(od::Address address) {
    return device_->dictionary().number(address).value_or(~0ULL);
  }
  std::uint32_t entry_of(image::Direction direction) {
    const auto& entries = seat().line->layout(direction).entries;
    const auto found = std::ranges::find(entries, kOwnObject, &image::Entry::index);
    EXPECT_NE(found, entries.end());
    return static_cast<std::uint32_t>(found - entries.begin());
  }

  sim::Device* device_ = nullptr;
};

TEST_F(MpdoTest, AValueGoesToADeviceAndComesBackIntoTheImage) {
  start();
  line::Command write{.request = line::MpdoWrite{.node = kDevice,
                                                 .address = {kGiven.index, 0},
                                                 .data = plant::number(0x1234)}};
  EXPECT_EQ(wait(execute(std::move(write))).error, Error{});
  pass(20ms);
  EXPECT_EQ(of_device(kGiven), 0x1234U);
  const line::Line::Input came = seat().line->input(entry_of(image::Direction::inputs));
  EXPECT_EQ(came.value, 0x1234U);
  EXPECT_TRUE(came.valid);
}

TEST_F(MpdoTest, AnOutputOfTheScannerListIsInTheDevice) {
  start();
  line::OutputWrite write{.layout_id = seat().line->layout(image::Direction::outputs).id};
  write.arming = 1;
  write.values.push_back({.entry = entry_of(image::Direction::outputs), .length = 4, .data = {}});
  write.values[0].data[0] = std::byte{0x77};
  EXPECT_EQ(seat().line->write_outputs(write, world().now()), line::OutputRefusal::none);
  world().settle();
  pass(20ms);
  EXPECT_EQ(of_device(kFollows), 0x77U);
}

TEST_F(MpdoTest, ADeviceAnswersARemoteFrameWithItsPdo) {
  start();
  const std::uint64_t before = seat().line->state().counters.rpdos;
  line::Command request{.request = line::PdoRequest{.node = kDevice, .number = 1}};
  EXPECT_EQ(wait(execute(std::move(request))).error, Error{});
  EXPECT_GT(seat().line->state().counters.rpdos, before);
  line::Command other{.request = line::PdoRequest{.node = kDevice, .number = 2}};
  EXPECT_NE(wait(execute(std::move(other))).error, Error{}) << "its COB-ID permits no RTR";
}

}  // namespace
}  // namespace linegate::plant
