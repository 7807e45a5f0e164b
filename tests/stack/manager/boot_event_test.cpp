// SPDX-License-Identifier: Apache-2.0
#include "stack/manager/boot_event.h"

#include <gtest/gtest.h>

#include "stack/manager/program_run.h"
#include "stack/od/objects.h"

namespace linegate::manager {
namespace {

BootFinding aborted() {
  return {.kind = BootFinding::Kind::abort,
          .object = {0x1017, 0},
          .abort = AbortCode::no_object,
          .expected = 0,
          .found = 0};
}

BootFinding differs() {
  return {.kind = BootFinding::Kind::value,
          .object = {0x1018, 2},
          .abort = AbortCode::none,
          .expected = 7,
          .found = 0x1234'5678};
}

TEST(BootEvent, SaysTheObjectAndWhatWasFound) {  // 1F80h, 1F81h
  const Event event = boot_result(5, 'M', differs(), Instant{});
  EXPECT_EQ(event.node, 5);
  const auto& result = std::get<event::BootResult>(event.data);
  EXPECT_EQ(result.letter, 'M');
  EXPECT_EQ(result.found, 0x1234'5678U);
  EXPECT_EQ(finding_of(result), differs());
  const Event refused = boot_result(5, 'J', aborted(), Instant{});
  const auto& abort = std::get<event::BootResult>(refused.data);
  EXPECT_EQ(finding_of(abort), aborted());
  EXPECT_EQ(abort.abort, AbortCode::no_object);
}

TEST(BootEvent, OfALetterAloneHasNoData) {
  const Event event = boot_result(5, 'K', {}, Instant{});
  EXPECT_EQ(event.data, EventData(event::BootResult{.letter = 'K'}));
  EXPECT_EQ(finding_of(std::get<event::BootResult>(event.data)), BootFinding{});
}

TEST(BootStatus, WhatCouldNotBeReadIsNotCalledAnother) {
  const auto ended = [](char letter, AbortCode abort) {
    const std::string words = describe_boot(
        letter, {.kind = BootFinding::Kind::abort, .object = {0x1018, 1}, .abort = abort});
    return words.substr(0, words.find(": 1018:01 ended with "));
  };
  const std::string pdo = describe_boot(
      'J', {.kind = BootFinding::Kind::abort, .object = {0x1800, 1}, .abort = AbortCode::general});
  EXPECT_EQ(pdo.substr(0, pdo.find(": 1800:01 ended with ")),
            "PDO could not be compared with the image, or configured");
  EXPECT_EQ(ended('J', AbortCode::no_object), "configuration failed");
  EXPECT_EQ(ended('B', AbortCode::timeout), "no answer to the SDO upload of 1000h");
  EXPECT_EQ(ended('B', AbortCode::no_object), "1000h cannot be read");
  EXPECT_EQ(ended('D', AbortCode::no_object), "vendor-ID cannot be read");
  EXPECT_EQ(ended('M', AbortCode::no_object), "product code cannot be read");
  EXPECT_EQ(ended('N', AbortCode::no_object), "revision number cannot be read");
  EXPECT_EQ(ended('O', AbortCode::no_object), "serial number cannot be read");
  EXPECT_EQ(ended('G', AbortCode::no_object), "software version cannot be read");
}

TEST(BootStatus, AFlashStatusHasItsWords) {
  EXPECT_EQ(describe_boot('I', {.kind = BootFinding::Kind::value,
                                .object = {od::objects::kFlashStatus, 1},
                                .expected = 0,
                                .found = 4}),
            "software update failed: 1F57:01 is 00000004h, not 00000000h, format of the program is "
            "unknown");
}

TEST(BootStatus, TheFindingIsSaidInWords) {
  EXPECT_EQ(describe_boot('M', differs()),
            "product code differs from the expected one: 1018:02 is 12345678h, not 00000007h");
  EXPECT_EQ(describe_boot('J', aborted()), "configuration failed: 1017:00 ended with 06020000h, " +
                                               std::string(describe(AbortCode::no_object)));
  EXPECT_EQ(describe_boot('K', {}), std::string(describe_boot('K')));
}

}  // namespace
}  // namespace linegate::manager
