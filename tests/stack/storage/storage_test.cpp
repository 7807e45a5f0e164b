// SPDX-License-Identifier: Apache-2.0
#include "stack/storage/storage.h"

#include <gtest/gtest.h>

#include "stack/base/byte_order.h"
#include "stack/od/objects.h"
#include "stack/storage/parameters.h"

namespace linegate::storage {
namespace {

using od::Access;
using od::DataType;

// A medium in memory that can be made to fail.
class TestMedium final : public Medium {
 public:
  bool read(std::vector<std::byte>& image) override {
    image = kept;
    return readable;
  }
  bool keep(std::span<const std::byte> image) override {
    if (writable) {
      kept.assign(image.begin(), image.end());
    }
    return writable;
  }

  bool slow() const override { return takes_its_time; }

  std::vector<std::byte> kept;
  bool readable = true;
  bool writable = true;
  bool takes_its_time = false;
};

od::VariableDescription variable(std::uint8_t sub, DataType type, std::uint64_t value,
                                 Access access = Access::rw) {
  od::VariableDescription out;
  out.sub = sub;
  out.type = type;
  out.access = access;
  out.value.resize(od::byte_size(type));
  store_le(std::span<std::byte>(out.value), value);
  return out;
}

od::ObjectDescription object(std::uint16_t index,
                             std::initializer_list<od::VariableDescription> variables) {
  od::ObjectDescription out;
  out.index = index;
  out.variables = variables;
  return out;
}

od::ObjectDescription commands(std::uint16_t index) {
  return object(index, {variable(0, DataType::unsigned8, 5, Access::constant),
                        variable(1, DataType::unsigned32, 0), variable(2, DataType::unsigned32, 0),
                        variable(3, DataType::unsigned32, 0), variable(4, DataType::unsigned32, 0),
                        variable(5, DataType::unsigned32, 0)});
}

od::VariableDescription text(std::string_view value) {
  od::VariableDescription out;
  out.type = DataType::visible_string;
  const auto raw = std::as_bytes(std::span(value));
  out.value.assign(raw.begin(), raw.end());
  return out;
}

// One parameter of each kind: 1017h communication, 2000h and the string 2001h manufacturer, 6000h
// application. 6200h is process data.
od::DeviceDescription device() {
  od::DeviceDescription out;
  out.objects = {
      commands(od::objects::kStoreParameters),
      commands(od::objects::kRestoreDefaults),
      object(0x1017, {variable(0, DataType::unsigned16, 100)}),
      object(0x1018, {variable(0, DataType::unsigned8, 1, Access::constant),
                      variable(1, DataType::unsigned32, 0x4C47, Access::ro)}),
      object(od::objects::kVerifyConfiguration,
             {variable(0, DataType::unsigned8, 2, Access::constant),
              variable(1, DataType::unsigned32, 0), variable(2, DataType::unsigned32, 0)}),
      object(0x2000, {variable(0, DataType::unsigned24, 200)}),
      object(0x2001, {text("default")}),
      object(0x6000, {variable(0, DataType::unsigned32, 600)}),
      object(0x6200, {variable(0, DataType::unsigned32, 620)}),
  };
  out.objects.back().variables.front().mappable = true;
  mark_parameters(out);
  return out;
}

constexpr od::Address kDate{od::objects::kVerifyConfiguration, 1};
constexpr od::Address kTime{od::objects::kVerifyConfiguration, 2};

class StorageTest : public ::testing::Test {
 protected:
  StorageTest() { power_on(); }

  // A new device with the same medium.
  Damage power_on(std::uint8_t node_id = 5) {
    dictionary = od::Dictionary(description);
    storage = std::make_unique<Storage>(dictionary, node_id);
    storage->set_medium(&medium);
    (void)dictionary.set_hook(od::objects::kStoreParameters, storage.get()).ok();
    (void)dictionary.set_hook(od::objects::kRestoreDefaults, storage.get()).ok();
    (void)dictionary.set_hook(od::objects::kVerifyConfiguration, &storage->configuration()).ok();
    const Damage damage = storage->load();
    storage->apply(true);
    return damage;
  }
  void reset_communication() {
    dictionary.reset_values(0x1000, 0x1FFF);
    storage->apply(false);
  }
  void reset_node() {
    dictionary.reset_values(0x0001, 0xFFFF);
    storage->apply(true);
  }

  AbortCode write(od::Address address, std::uint32_t value, std::size_t size = 4) {
    std::array<std::byte, 4> raw{};
    store_le(raw.data(), value);
    return dictionary.write(address, std::span(raw).first(size));
  }
  AbortCode save(std::uint8_t sub) { return write({od::objects::kStoreParameters, sub}, kSave); }
  AbortCode load(std::uint8_t sub) { return write({od::objects::kRestoreDefaults, sub}, kLoad); }
  std::uint64_t read(od::Address address) {
    const auto value = dictionary.read(address);
    return value ? load_le(*value) : ~std::uint64_t{0};
  }
  void change_all() {
    EXPECT_EQ(write({0x1017, 0}, 101, 2), AbortCode::none);
    EXPECT_EQ(write({0x2000, 0}, 201, 3), AbortCode::none);
    EXPECT_EQ(write({0x6000, 0}, 601), AbortCode::none);
    EXPECT_EQ(write({0x6200, 0}, 621), AbortCode::none);
  }
  // The values of 1017h, 2000h, 6000h, 6200h.
  std::vector<std::uint64_t> values() {
    return {read({0x1017, 0}), read({0x2000, 0}), read({0x6000, 0}), read({0x6200, 0})};
  }

  od::DeviceDescription description = device();
  TestMedium medium;
  od::Dictionary dictionary;
  std::unique_ptr<Storage> storage;
};

using Values = std::vector<std::uint64_t>;

TEST_F(StorageTest, SubIndicesMeanTheirParameters) {
  const std::pair<std::uint8_t, Values> kRows[] = {{kAll, {101, 201, 601, 620}},
                                                   {kCommunication, {101, 200, 600, 620}},
                                                   {kApplication, {100, 200, 601, 620}},
                                                   {kManufacturer, {100, 201, 600, 620}}};
  for (const auto& [sub, expected] : kRows) {
    medium.kept.clear();
    power_on();
    change_all();
    EXPECT_EQ(save(sub), AbortCode::none);
    EXPECT_EQ(power_on(), Damage::none);
    EXPECT_EQ(values(), expected) << "1010h:" << int{sub};
  }
}

TEST_F(StorageTest, StoringSomeLeavesTheOthersAsTheyWereStored) {
  change_all();
  EXPECT_EQ(save(kAll), AbortCode::none);
  EXPECT_EQ(write({0x1017, 0}, 102, 2), AbortCode::none);
  EXPECT_EQ(write({0x6000, 0}, 602), AbortCode::none);
  EXPECT_EQ(save(kCommunication), AbortCode::none);
  power_on();
  EXPECT_EQ(values(), (Values{102, 201, 601, 620}));
}

TEST_F(StorageTest, AValueForTheTimeBeingIsNotStored) {
  storage->set_adjustment([](StoredValue& value) {
    if (value.address == od::Address{0x6000, 0}) {
      store_le(std::span(value.data), 600);
    }
  });
  change_all();
  EXPECT_EQ(save(kAll), AbortCode::none);
  EXPECT_EQ(read({0x6000, 0}), 601U) << "it holds";
  power_on();
  EXPECT_EQ(values(), (Values{101, 201, 600, 620}));
}

TEST_F(StorageTest, StringsAreStoredInTheirLength) {
  for (const std::string_view value : {"a longer one than it was", "", "short"}) {
    const auto raw = std::as_bytes(std::span(value));
    EXPECT_EQ(dictionary.write({0x2001, 0}, raw), AbortCode::none);
    EXPECT_EQ(save(kAll), AbortCode::none);
    power_on();
    const auto got = dictionary.read({0x2001, 0});
    ASSERT_TRUE(got.ok());
    EXPECT_TRUE(std::ranges::equal(*got, raw)) << value;
  }
}

TEST_F(StorageTest, ResetsGiveStoredValues) {
  change_all();
  EXPECT_EQ(save(kAll), AbortCode::none);
  EXPECT_EQ(write({0x1017, 0}, 102, 2), AbortCode::none);
  EXPECT_EQ(write({0x2000, 0}, 202, 3), AbortCode::none);
  reset_communication();
  EXPECT_EQ(values(), (Values{101, 202, 601, 621}));
  reset_node();
  EXPECT_EQ(values(), (Values{101, 201, 601, 620}));
}

TEST_F(StorageTest, RestoringDefaultsTakesEffectAtTheReset) {
  change_all();
  EXPECT_EQ(save(kAll), AbortCode::none);
  EXPECT_EQ(load(kCommunication), AbortCode::none);
  EXPECT_EQ(values(), (Values{101, 201, 601, 621}));
  reset_communication();
  EXPECT_EQ(values(), (Values{100, 201, 601, 621}));
  EXPECT_EQ(load(kAll), AbortCode::none);
  reset_node();
  EXPECT_EQ(values(), (Values{100, 200, 600, 620}));
}

TEST_F(StorageTest, RestoringDefaultsTakesEffectAtPowerOn) {
  for (const std::uint8_t sub : {kAll, kCommunication, kApplication, kManufacturer}) {
    change_all();
    EXPECT_EQ(save(kAll), AbortCode::none);
    EXPECT_EQ(load(sub), AbortCode::none);
    power_on();
    const Values expected = {covers(sub, 0x1017) ? 100U : 101U, covers(sub, 0x2000) ? 200U : 201U,
                             covers(sub, 0x6000) ? 600U : 601U, 620};
    EXPECT_EQ(values(), expected) << "1011h:" << int{sub};
  }
}

TEST_F(StorageTest, OnlyTheSignatureDoesAnything) {
  change_all();
  for (const std::uint32_t wrong : {0U, 1U, kLoad, 0x7361'7665U}) {
    EXPECT_EQ(write({od::objects::kStoreParameters, 1}, wrong), AbortCode::cannot_transfer);
  }
  for (const std::uint32_t wrong : {0U, 1U, kSave, 0x6C6F'6164U}) {
    EXPECT_EQ(write({od::objects::kRestoreDefaults, 1}, wrong), AbortCode::cannot_transfer);
  }
  EXPECT_TRUE(medium.kept.empty());
  EXPECT_EQ(storage->kept(), 0U);
}

TEST_F(StorageTest, SubIndicesBeyondTheKnownAreRefused) {
  EXPECT_EQ(save(5), AbortCode::cannot_transfer);
  EXPECT_EQ(load(5), AbortCode::cannot_transfer);
  EXPECT_EQ(save(6), AbortCode::no_sub_index);
  EXPECT_EQ(save(0), AbortCode::read_only);
  EXPECT_EQ(write({od::objects::kStoreParameters, 1}, 0x6173, 2), AbortCode::length_too_low);
}

TEST_F(StorageTest, ReadingTellsThatItStoresOnCommand) {
  for (const std::uint16_t index : {od::objects::kStoreParameters, od::objects::kRestoreDefaults}) {
    EXPECT_EQ(read({index, 0}), 5U);
    for (std::uint8_t sub = kAll; sub <= kManufacturer; ++sub) {
      EXPECT_EQ(read({index, sub}), 1U);
    }
    EXPECT_EQ(read({index, 5}), 0U);
  }
  EXPECT_EQ(save(kAll), AbortCode::none);
  EXPECT_EQ(read({od::objects::kStoreParameters, 1}), 1U) << "not the signature";
}

TEST_F(StorageTest, WithoutAMediumNothingIsStored) {
  storage->set_medium(nullptr);
  EXPECT_EQ(save(kAll), AbortCode::cannot_transfer);
  EXPECT_EQ(load(kAll), AbortCode::cannot_transfer);
  EXPECT_EQ(read({od::objects::kStoreParameters, 1}), 0U);
  EXPECT_EQ(read({od::objects::kRestoreDefaults, 1}), 0U);
  EXPECT_EQ(storage->load(), Damage::none);
}

TEST_F(StorageTest, AMediumThatFailsIsAHardwareError) {
  change_all();
  EXPECT_EQ(save(kAll), AbortCode::none);
  EXPECT_EQ(write({0x6000, 0}, 602), AbortCode::none);
  medium.writable = false;
  EXPECT_EQ(save(kAll), AbortCode::hardware);
  EXPECT_EQ(load(kAll), AbortCode::hardware);
  reset_node();
  EXPECT_EQ(values(), (Values{101, 201, 601, 620})) << "the previous values remain stored";
  EXPECT_EQ(storage->kept(), 1U);
}

// A hook that refuses every write. The check of a write must change nothing.
struct Refusing final : od::Hook {
  AbortCode check_write(od::Address /*address*/, std::span<const std::byte> /*value*/) override {
    return AbortCode::local_control;
  }
};

TEST_F(StorageTest, NothingIsKeptUntilNobodyRefuses) {
  constexpr std::array<std::byte, 4> kSaveBytes{std::byte{'s'}, std::byte{'a'}, std::byte{'v'},
                                                std::byte{'e'}};
  change_all();
  EXPECT_EQ(dictionary.check({od::objects::kStoreParameters, kAll}, kSaveBytes), AbortCode::none);
  EXPECT_TRUE(medium.kept.empty());

  const std::array<od::Assignment, 2> group{
      od::Assignment{{od::objects::kStoreParameters, kAll}, kSaveBytes},
      od::Assignment{{0x1018, 1}, kSaveBytes},  // 1018h:1 is read-only
  };
  EXPECT_EQ(dictionary.write_all(group), AbortCode::read_only);
  EXPECT_TRUE(medium.kept.empty());

  Refusing application;
  ASSERT_TRUE(dictionary.add_hook(od::objects::kStoreParameters, application).ok());
  EXPECT_EQ(save(kAll), AbortCode::local_control);
  EXPECT_TRUE(medium.kept.empty());
  EXPECT_EQ(storage->kept(), 0U);
  dictionary.remove_hook(od::objects::kStoreParameters, application);
  EXPECT_EQ(dictionary.write_all(std::span(group).first(1)), AbortCode::none);
  EXPECT_EQ(storage->kept(), 1U);
}

TEST_F(StorageTest, AGroupThatFailsOnTheWayTellsWhichOneDid) {
  constexpr std::array<std::byte, 4> kSaveBytes{std::byte{'s'}, std::byte{'a'}, std::byte{'v'},
                                                std::byte{'e'}};
  constexpr std::array<std::byte, 2> kNumber{std::byte{101}, std::byte{0}};
  const std::array<od::Assignment, 2> group{
      od::Assignment{{0x1017, 0}, kNumber},
      od::Assignment{{od::objects::kStoreParameters, kAll}, kSaveBytes},
  };
  medium.writable = false;
  std::size_t refused = 9;
  EXPECT_EQ(dictionary.write_all(group, &refused), AbortCode::hardware);
  EXPECT_EQ(refused, 1U);
  EXPECT_EQ(read({0x1017, 0}), 100U) << "no value of the group is written";
}

TEST_F(StorageTest, WhatCannotBeUsedLeavesAllDefaults) {
  const Values defaults = {100, 200, 600, 620};
  change_all();
  EXPECT_EQ(save(kAll), AbortCode::none);
  const std::vector<std::byte> good = medium.kept;

  medium.kept[30] ^= std::byte{1};
  EXPECT_EQ(power_on(), Damage::damaged);
  EXPECT_EQ(values(), defaults);
  medium.kept = good;
  medium.readable = false;
  EXPECT_EQ(power_on(), Damage::unreadable);
  EXPECT_EQ(values(), defaults);
  medium.readable = true;
  EXPECT_EQ(power_on(6), Damage::owner);
  EXPECT_EQ(values(), defaults);
  EXPECT_EQ(power_on(), Damage::none);
  EXPECT_EQ(values(), (Values{101, 201, 601, 620}));
}

TEST_F(StorageTest, AValueThatHasNoPlaceMakesAllOfThemUseless) {
  const StoredValue good{{0x1017, 0}, {std::byte{1}, std::byte{2}}};
  const StoredValue kWrong[] = {
      {{0x5000, 0}, {std::byte{1}}},                              // no such object
      {{0x1017, 1}, {std::byte{1}}},                              // no such sub-index
      {{0x1017, 0}, {std::byte{1}}},                              // too short
      {{0x1017, 0}, {std::byte{1}, std::byte{2}, std::byte{3}}},  // too long
      {{0x2001, 0}, std::vector<std::byte>(65)},                  // string too long
      {{0x6200, 0}, std::vector<std::byte>(4)},                   // not stored
      // A command, not a parameter
      {{od::objects::kRestoreDefaults, 1}, std::vector<std::byte>(4)},
  };
  for (const StoredValue& wrong : kWrong) {
    const std::vector<StoredValue> both = {good, wrong};
    medium.kept = encode({5, {0x4C47, 0, 0}}, both);
    EXPECT_EQ(power_on(), Damage::unusable) << std::hex << wrong.address.index;
    EXPECT_EQ(read({0x1017, 0}), 100U);
  }
  medium.kept = encode({5, {0x4C47, 0, 0}}, std::vector{good});
  EXPECT_EQ(power_on(), Damage::none);
  EXPECT_EQ(read({0x1017, 0}), 0x201U);
}

// --- a slow medium -----------------------------------------------------------------------------

class SlowStorageTest : public StorageTest {
 protected:
  SlowStorageTest() { medium.takes_its_time = true; }

  // Starts a write that may complete later. Returns its ticket; 0 if it was refused immediately
  // with `refused`.
  od::Ticket begin(od::Address address, std::uint32_t value) {
    std::array<std::byte, 4> raw{};
    store_le(raw.data(), value);
    od::Ticket ticket = 0;
    refused = dictionary.write(address, raw, ticket);
    return ticket;
  }
  AbortCode end(od::Ticket ticket) {
    std::array<std::byte, 4> raw{};
    return dictionary.finish_write(ticket, raw);
  }

  AbortCode refused = AbortCode::none;
};

TEST_F(SlowStorageTest, TheAnswerComesWhenTheMediumIsDone) {
  change_all();
  const od::Ticket ticket = begin({od::objects::kStoreParameters, kAll}, kSave);
  EXPECT_EQ(refused, od::kLater);
  EXPECT_EQ(dictionary.outcome(ticket), std::nullopt);
  EXPECT_TRUE(storage->stored().empty());
  EXPECT_EQ(write({0x1017, 0}, 102, 2), AbortCode::none) << "not part of the running operation";
  storage->done(true);
  EXPECT_EQ(end(ticket), AbortCode::none);
  reset_node();
  EXPECT_EQ(values(), (Values{101, 201, 601, 620}));
  EXPECT_EQ(storage->kept(), 1U);
}

TEST_F(SlowStorageTest, AFailureIsAHardwareErrorAndChangesNothing) {
  change_all();
  const od::Ticket ticket = begin({od::objects::kStoreParameters, kAll}, kSave);
  storage->done(false);
  EXPECT_EQ(end(ticket), AbortCode::hardware);
  reset_node();
  EXPECT_EQ(values(), (Values{100, 200, 600, 620}));
  medium.writable = false;
  EXPECT_EQ(end(begin({od::objects::kStoreParameters, kAll}, kSave)), AbortCode::hardware)
      << "the medium cannot be written";
}

TEST_F(SlowStorageTest, OneAtATime) {
  const od::Ticket ticket = begin({od::objects::kStoreParameters, kAll}, kSave);
  EXPECT_EQ(begin({od::objects::kRestoreDefaults, kAll}, kLoad), 0U);
  EXPECT_EQ(refused, AbortCode::device_state);
  storage->done(true);
  EXPECT_EQ(end(ticket), AbortCode::none);
  EXPECT_EQ(begin({od::objects::kStoreParameters, kAll}, kLoad), 0U);
  EXPECT_EQ(refused, AbortCode::cannot_transfer);
}

TEST_F(SlowStorageTest, WhoAskedMayGiveUpAndItIsStoredAllTheSame) {
  change_all();
  dictionary.cancel(begin({od::objects::kStoreParameters, kAll}, kSave));
  storage->done(true);
  storage->done(true);
  EXPECT_EQ(storage->kept(), 1U);
  reset_node();
  EXPECT_EQ(values(), (Values{101, 201, 601, 620}));
}

TEST_F(SlowStorageTest, WhoCannotWaitIsRefusedAndNothingBegins) {
  EXPECT_EQ(save(kAll), AbortCode::device_state);
  EXPECT_TRUE(medium.kept.empty());
}

// --- 1020h ---------------------------------------------------------------------------------------

TEST_F(StorageTest, TheConfigurationIsVerifiedAfterPowerOn) {  // 5.8 1020h of the own node
  change_all();
  EXPECT_EQ(write(kDate, 15'000), AbortCode::none);
  EXPECT_EQ(write(kTime, 3'600'000), AbortCode::none);
  EXPECT_EQ(save(kAll), AbortCode::none);
  power_on();
  EXPECT_EQ(read(kDate), 15'000U);
  EXPECT_EQ(read(kTime), 3'600'000U);
}

TEST_F(StorageTest, EveryParameterThatChangesClearsTheConfigurationDate) {
  struct Row {
    od::Address address;
    std::uint32_t value;
    std::size_t size;
    bool clears;
  };
  constexpr Row kRows[] = {{{0x1017, 0}, 7, 2, true},
                           {{0x2000, 0}, 7, 3, true},
                           {{0x2001, 0}, 7, 1, true},
                           {{0x6000, 0}, 7, 4, true},
                           {{0x6200, 0}, 7, 4, false}};
  for (const Row& row : kRows) {
    power_on();
    write(kDate, 15'000);
    write(kTime, 1);
    EXPECT_EQ(read(kDate), 15'000U);
    EXPECT_EQ(write(row.address, row.value, row.size), AbortCode::none);
    EXPECT_EQ(read(kTime), row.clears ? 0U : 1U) << std::hex << row.address.index;
    EXPECT_EQ(read(kDate), row.clears ? 0U : 15'000U) << std::hex << row.address.index;
  }
}

TEST_F(StorageTest, AClearedDateIsStoredAsZero) {
  write(kDate, 15'000);
  write(kTime, 1);
  change_all();
  EXPECT_EQ(save(kAll), AbortCode::none) << "without a read in between";
  power_on();
  EXPECT_EQ(read(kDate), 0U);
}

TEST_F(StorageTest, ResetCommunicationDoesNotHideAChangedApplicationParameter) {
  write(kDate, 15'000);
  write(kTime, 1);
  EXPECT_EQ(save(kAll), AbortCode::none);
  write({0x1017, 0}, 7, 2);
  EXPECT_EQ(read(kDate), 0U);
  reset_communication();
  EXPECT_EQ(read(kDate), 15'000U) << "1017h is as configured again";
  write({0x6000, 0}, 7);
  reset_communication();
  EXPECT_EQ(read(kDate), 0U);
  reset_node();
  EXPECT_EQ(read(kDate), 15'000U);
}

// --- the values that are stored: parameters ----------------------------------------------------

TEST(Parameters, ByRule) {
  struct Row {
    std::uint16_t index;
    Access access;
    bool mappable;
    DataType type;
    bool parameter;
  };
  constexpr Row kRows[] = {
      {0x1005, Access::rw, false, DataType::unsigned32, true},
      {0x1016, Access::rw, false, DataType::unsigned32, true},
      {0x1018, Access::ro, false, DataType::unsigned32, false},
      {0x1003, Access::rw, false, DataType::unsigned8, false},
      {0x1010, Access::rw, false, DataType::unsigned32, false},
      {0x1011, Access::rw, false, DataType::unsigned32, false},
      {0x1013, Access::rw, true, DataType::unsigned32, false},
      {0x1020, Access::rw, false, DataType::unsigned32, true},
      {0x1023, Access::rw, false, DataType::octet_string, false},
      {0x1200, Access::rw, false, DataType::unsigned32, true},
      {0x1600, Access::rw, false, DataType::unsigned32, true},
      {0x1F22, Access::rw, false, DataType::domain, false},
      {0x1F25, Access::wo, false, DataType::unsigned32, false},
      {0x1F51, Access::rw, false, DataType::unsigned8, false},
      {0x1F80, Access::rw, false, DataType::unsigned32, true},
      {0x1F82, Access::rw, false, DataType::unsigned8, false},
      {0x2000, Access::rw, false, DataType::unsigned32, true},
      {0x2000, Access::rw, true, DataType::unsigned32, false},
      {0x2000, Access::rww, false, DataType::visible_string, true},
      {0x2000, Access::rw, false, DataType::domain, false},
      {0x2000, Access::wo, false, DataType::unsigned32, false},
      {0x6081, Access::rw, false, DataType::unsigned32, true},
      {0x6040, Access::rww, true, DataType::unsigned16, false},
      {0xA000, Access::rw, false, DataType::unsigned8, false},
  };
  for (const Row& row : kRows) {
    od::VariableDescription variable;
    variable.access = row.access;
    variable.mappable = row.mappable;
    variable.type = row.type;
    EXPECT_EQ(is_parameter(row.index, variable), row.parameter) << std::hex << row.index;
  }
}

}  // namespace
}  // namespace linegate::storage
