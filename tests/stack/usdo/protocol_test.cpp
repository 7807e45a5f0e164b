// SPDX-License-Identifier: Apache-2.0
#include "stack/usdo/protocol.h"

#include <array>

#include "tests/stack/usdo/support.h"

namespace linegate::usdo::test {
namespace {

constexpr Route kRequest{kRequestId, kServer, 9};
constexpr od::Address kObject{0x2345, 0x67};

Bytes content(const can::Frame& frame) {
  EXPECT_EQ(frame.id, kRequestId);
  EXPECT_TRUE(well_formed(frame));
  return numbers(frame.bytes());
}

TEST(UsdoFrames, HaveTheBytesOfTheTable) {
  const std::vector<std::byte> three = bytes({0xA1, 0xA2, 0xA3});
  EXPECT_EQ(content(object_frame(kRequest, Command::upload, kObject)),
            (Bytes{5, 0x11, 9, 0x67, 0x45, 0x23}));
  EXPECT_EQ(content(expedited_frame(kRequest, Command::download, kObject, od::DataType::unsigned24,
                                    three)),
            (Bytes{5, 0x01, 9, 0x67, 0x45, 0x23, 0x16, 3, 0xA1, 0xA2, 0xA3, 0}));
  EXPECT_EQ(content(initiate_frame(kRequest, Command::download_initiate, kObject,
                                   od::DataType::domain, 0x0403'0201)),
            (Bytes{5, 0x02, 9, 0x67, 0x45, 0x23, 0x0F, 0, 1, 2, 3, 4}));
  EXPECT_EQ(content(segment_frame(kRequest, Command::download_segment, 7, pattern(60))),
            padded({5, 0x03, 9, 7}, numbers_from(0, 60)));
  EXPECT_EQ(content(end_frame(kRequest, Command::download_end, three)),
            (Bytes{5, 0x04, 9, 3, 0xA1, 0xA2, 0xA3}));
  EXPECT_EQ(content(counted_frame(kRequest, Command::upload_segment, 8)), (Bytes{5, 0x13, 9, 8}));
  EXPECT_EQ(content(plain_frame(kRequest, Command::end_response)), (Bytes{5, 0x24, 9}));
}

TEST(UsdoFrames, AreAsLongAsCanFdPermits) {
  for (std::size_t size = 0; size <= kExpeditedData; ++size) {
    const can::Frame frame =
        expedited_frame(kRequest, Command::download, kObject, od::DataType::domain, pattern(size));
    EXPECT_EQ(frame.length, can::fd_length(8 + size));
    EXPECT_EQ(numbers(*data_of(frame)), numbers(pattern(size)));
  }
}

TEST(UsdoFrames, TheAbortHasTwoForms) {
  EXPECT_EQ(content(abort_frame(kRequest, kObject, AbortCode::read_only, AbortForm::one_byte)),
            (Bytes{5, 0x7F, 9, 0x67, 0x45, 0x23, 0x32}));
  EXPECT_EQ(content(abort_frame(kRequest, kObject, AbortCode::read_only, AbortForm::four_bytes)),
            (Bytes{5, 0x80, 9, 0x67, 0x45, 0x23, 0x02, 0x00, 0x01, 0x06, 0, 0}));
  EXPECT_EQ(content(abort_frame(kRequest, kObject, Code::session, AbortForm::one_byte)),
            (Bytes{5, 0x7F, 9, 0x67, 0x45, 0x23, 0x21}));
  EXPECT_EQ(content(abort_frame(kRequest, kObject, Code::session, AbortForm::four_bytes)),
            (Bytes{5, 0x80, 9, 0x67, 0x45, 0x23, 0x23, 0x00, 0x0A, 0x06, 0, 0}));
  for (const AbortForm form : {AbortForm::one_byte, AbortForm::four_bytes}) {
    EXPECT_EQ(reason_of(abort_frame(kRequest, kObject, AbortCode::no_object, form)),
              AbortCode::no_object);
  }
}

TEST(UsdoFrames, WithoutTheirFieldsAreRecognised) {
  struct Row {
    Command command;
    std::size_t bytes;
  };
  constexpr std::array kRows{Row{Command::download, 8},
                             Row{Command::download_initiate, 12},
                             Row{Command::download_segment, 4},
                             Row{Command::download_end, 4},
                             Row{Command::upload, 6},
                             Row{Command::upload_segment, 4},
                             Row{Command::download_response, 6},
                             Row{Command::initiate_response, 6},
                             Row{Command::segment_response, 4},
                             Row{Command::end_response, 3},
                             Row{Command::upload_response, 8},
                             Row{Command::upload_initiate, 12},
                             Row{Command::upload_segment_answer, 4},
                             Row{Command::upload_end, 4},
                             Row{Command::abort, 7},
                             Row{Command::long_abort, 10}};
  for (const Row& row : kRows) {
    can::Frame frame = plain_frame(kRequest, row.command);
    frame.length = static_cast<std::uint8_t>(row.bytes);
    EXPECT_TRUE(has_fields(frame)) << static_cast<int>(row.command);
    --frame.length;
    EXPECT_FALSE(has_fields(frame)) << static_cast<int>(row.command);
  }
  for (const unsigned unknown :
       {0x00U, 0x05U, 0x10U, 0x12U, 0x14U, 0x25U, 0x30U, 0x35U, 0x7EU, 0x81U}) {
    can::Frame frame = plain_frame(kRequest, static_cast<Command>(unknown));
    frame.length = 64;
    EXPECT_FALSE(has_fields(frame)) << unknown;
  }
}

TEST(UsdoFrames, MayNotClaimMoreDataThanTheyHave) {
  EXPECT_FALSE(data_of(fd_frame(kRequestId, {5, 1, 9, 0, 0, 0x20, 5, 5, 1, 2, 3, 4})));
  EXPECT_TRUE(data_of(fd_frame(kRequestId, {5, 1, 9, 0, 0, 0x20, 5, 4, 1, 2, 3, 4})));
  EXPECT_FALSE(data_of(fd_frame(kRequestId, {5, 4, 9, 61, 1, 2, 3, 4})));
  EXPECT_FALSE(data_of(fd_frame(kRequestId, {5, 3, 9, 0, 1, 2, 3, 4})));
  EXPECT_FALSE(data_of(fd_frame(kRequestId, {5, 0x24, 9, 0, 1, 2, 3, 4})));
}

TEST(UsdoFrames, AreCanFdDataFrames) {
  can::Frame frame = fd_frame(kRequestId, {5, 0x24, 9});
  EXPECT_TRUE(well_formed(frame));
  frame.length = 2;
  EXPECT_FALSE(well_formed(frame));
  EXPECT_FALSE(well_formed(can::make_frame(kRequestId, {5, 0x11, 9, 0, 0, 0x10})));
}

struct CodeRow {
  std::uint8_t code;
  std::uint32_t abort;
  std::string_view words;
};
constexpr CodeRow kCodes[] = {
    {0x13, 0x0504'0001, "command specifier not valid"},
    {0x14, 0x0504'0003, "segment counter not valid"},
    {0x15, 0x0607'0010, "size not valid"},
    {0x21, 0x060A'0023, "session-ID not valid"},
    {0x31, 0x0601'0001, "object is write-only"},
    {0x32, 0x0601'0002, "object is read-only"},
    {0x33, 0x0602'0000, "object does not exist"},
    {0x34, 0x0609'0011, "sub-index does not exist"},
    {0x36, 0x0607'0010, "type or length does not match"},
    {0x37, 0x0607'0012, "value is too long"},
    {0x38, 0x0607'0013, "value is too short"},
    {0x60, 0x0800'0020, "value cannot be transferred or stored"},
    {0x62, 0x0800'0022, "device state does not permit the access"},
};

TEST(UsdoAbortCodes, HaveWordsAndAnSdoAbortCode) {
  for (const CodeRow& row : kCodes) {
    EXPECT_EQ(static_cast<std::uint32_t>(to_abort_code(static_cast<Code>(row.code))), row.abort);
    EXPECT_EQ(describe(static_cast<Code>(row.code)), row.words);
  }
  unsigned known = 0;
  for (unsigned code = 0; code <= 0xFF; ++code) {
    known += describe(static_cast<Code>(code)) != "unknown abort code" ? 1U : 0U;
  }
  EXPECT_EQ(known, std::size(kCodes));
  EXPECT_EQ(to_abort_code(static_cast<Code>(0xFF)), AbortCode::general);
}

TEST(UsdoAbortCodes, AreChosenByTheSdoAbortCode) {
  for (const CodeRow& row : kCodes) {
    if (row.code != 0x15) {
      EXPECT_EQ(static_cast<int>(to_code(static_cast<AbortCode>(row.abort))), row.code);
    }
  }
  // OWN: 60h for every reason without a code of its own.
  for (const AbortCode other : {AbortCode::timeout, AbortCode::out_of_memory,
                                AbortCode::value_too_high, AbortCode::general}) {
    EXPECT_EQ(to_code(other), Code::cannot_transfer);
  }
}

TEST(UsdoAbortCodes, OfFourBytesAreNeverAnInternalValue) {
  EXPECT_EQ(reason_of(fd_frame(kRequestId, {5, 0x80, 9, 0, 0, 0x20, 0, 0, 0, 0})),
            AbortCode::general);
  EXPECT_EQ(reason_of(fd_frame(kRequestId, {5, 0x80, 9, 0, 0, 0x20, 0xFF, 0xFF, 0xFF, 0xFF})),
            AbortCode::general);
}

}  // namespace
}  // namespace linegate::usdo::test
