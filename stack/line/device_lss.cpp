// SPDX-License-Identifier: Apache-2.0
#include "stack/line/device_lss.h"

#include <array>
#include <vector>

#include "stack/can/cob_id.h"

namespace linegate::line {
namespace {

constexpr std::size_t kLssAnswers = 8;

lss::Settings settings_of(const std::vector<std::byte>& image) {
  lss::Settings out;
  if (image.size() != 2) {
    return out;
  }
  const auto node_id = std::to_integer<std::uint8_t>(image[0]);
  if (node_id >= can::kMinNodeId && node_id <= can::kMaxNodeId) {
    out.node_id = node_id;
  }
  out.bit_timing = std::to_integer<std::uint8_t>(image[1]);
  return out;
}

}  // namespace

DeviceLss::DeviceLss(const lss::Address& address, std::uint32_t bit_rate)
    : slave_(address, this), answers_(kLssAnswers), bit_rate_(bit_rate) {
}

void DeviceLss::power_on() {
  std::vector<std::byte> image;
  const bool kept = medium_ != nullptr && medium_->read(image);
  slave_.power_on(kept ? settings_of(image) : lss::Settings{});
  answers_.clear();
}

void DeviceLss::medium_done(bool good) {
  slave_.stored(good, answers_);
}

lss::StoreResult DeviceLss::store(const lss::Settings& settings) {
  if (medium_ == nullptr) {
    return lss::StoreResult::unsupported;
  }
  const std::array image{std::byte{settings.node_id}, std::byte{settings.bit_timing}};
  if (!medium_->keep(image)) {
    return lss::StoreResult::failed;
  }
  return medium_->slow() ? lss::StoreResult::later : lss::StoreResult::stored;
}

bool DeviceLss::has_bit_timing(std::uint8_t index) const {
  return bit_rate_ != 0 && lss::bit_rate(index) == bit_rate_;
}

}  // namespace linegate::line
