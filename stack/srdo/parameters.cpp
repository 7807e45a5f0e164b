// SPDX-License-Identifier: Apache-2.0
#include "stack/srdo/parameters.h"

#include <array>
#include <cstddef>
#include <span>

#include "stack/base/byte_order.h"
#include "stack/image/layout.h"
#include "stack/sdo/block.h"

namespace linegate::srdo {
namespace {

class Signature {
 public:
  template <class Value>
  void add(Value value) {
    std::array<std::byte, sizeof(Value)> bytes{};
    store_le(bytes.data(), value);
    crc_ = sdo::crc_of(bytes, crc_);
  }
  std::uint16_t value() const { return crc_; }

 private:
  std::uint16_t crc_ = 0;
};

}  // namespace

std::vector<pdo::Mapping> Parameters::normal() const {
  std::vector<pdo::Mapping> out;
  for (std::size_t i = 0; i < mapping.size(); i += 2) {
    out.push_back(mapping[i]);
  }
  return out;
}

std::uint16_t signature(const Parameters& srdo) {
  Signature sum;
  sum.add(static_cast<std::uint8_t>(srdo.direction));
  sum.add(srdo.cycle_ms);
  sum.add(srdo.validation_ms);
  sum.add(srdo.cob_id);
  sum.add(srdo.inverted_cob_id);
  sum.add(static_cast<std::uint8_t>(srdo.mapping.size()));
  std::uint8_t sub = 0;
  for (const pdo::Mapping& entry : srdo.mapping) {
    sum.add(++sub);
    sum.add(entry.raw());
  }
  return sum.value();
}

pdo::Parameters as_pdo(const Parameters& srdo) {
  pdo::Parameters out;
  out.number = static_cast<std::uint16_t>(image::kFirstSrdo + srdo.number - 1);
  out.cob_id = {srdo.cob_id | can::CobId::kNoRtrBit};
  out.mapping = srdo.normal();
  return out;
}

}  // namespace linegate::srdo
