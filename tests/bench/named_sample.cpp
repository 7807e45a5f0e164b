// SPDX-License-Identifier: Apache-2.0
// A sample of a named topic, from the snapshot to its CDR: by the plan of the gateway, and by the
// code that fastddsgen generates for the same type, whose members are set from fixed places.
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <every_typePubSubTypes.h>

#include "bridges/named/sample_plan.h"
#include "gateway/config/plant.h"
#include "stack/base/byte_order.h"
#include "stack/line/line.h"

#include "tests/bench/measure.h"
#include "tests/paths.h"

namespace {

using namespace linegate;
using bench::Contestant;
using Sample = plant::press_every_inputs_26c77fbdaf07453c;
using SampleType = plant::press_every_inputs_26c77fbdaf07453cPubSubType;

constexpr int kSamples = 2000;  // of a pass
constexpr double kMost = 1;     // x the peer

named::DeviceType device_type() {
  const auto loaded = config::load(paths::in_repository("tests/bridges/named/every_type.yaml"));
  bench::require(loaded.value.has_value(), "every_type.yaml cannot be read");
  const auto made = line::Line::make(loaded.value->lines.at(0).config);
  bench::require(made.value.has_value(), "the line cannot be made");
  return named::device_types("press", (*made.value)->layout(image::Direction::inputs)).types.at(0);
}

// The values of the snapshot, by the numbers of the members.
class Image {
 public:
  explicit Image(const named::DeviceType& type) {
    for (const named::Member& member : type.members)
      places_.push_back(member.bit_offset / 8);
    snapshot.bytes.resize(256);
    for (std::size_t i = 0; i < snapshot.bytes.size(); ++i)
      snapshot.bytes[i] = static_cast<std::byte>('a' + i % 23);
    snapshot.valid = snapshot.known = {~std::uint64_t{0}};
  }

  std::span<const std::byte> bytes_of(std::size_t member, std::size_t size) const {
    return std::span(snapshot.bytes).subspan(places_[member], size);
  }
  std::uint64_t unsigned_of(std::size_t member, std::size_t size) const {
    return load_le(bytes_of(member, size));
  }
  std::int64_t signed_of(std::size_t member, std::size_t size) const {
    return load_le_signed(bytes_of(member, size));
  }
  std::string_view text_of(std::size_t member) const {
    return {reinterpret_cast<const char*>(bytes_of(member, 8).data()), 8};
  }
  std::array<std::uint8_t, 8> octets_of(std::size_t member) const {
    return std::bit_cast<std::array<std::uint8_t, 8>>(
        load_le<std::uint64_t>(bytes_of(member, 8).data()));
  }

  image::Snapshot snapshot;

 private:
  std::vector<std::size_t> places_;
};

void set_values(const Image& from, plant::press_every_inputs_26c77fbdaf07453c_values& to) {
  to.Flag((from.bytes_of(0, 1)[0] & std::byte{1}) != std::byte{0});
  to.Second_flag((from.bytes_of(1, 1)[0] & std::byte{1}) != std::byte{0});
  to.class_(static_cast<std::int8_t>(from.signed_of(2, 1)));
  to.n24V_supply(static_cast<std::uint8_t>(from.unsigned_of(3, 1)));
  to.Signed_16(static_cast<std::int16_t>(from.signed_of(4, 2)));
  to.Unsigned_16(static_cast<std::uint16_t>(from.unsigned_of(5, 2)));
  to.Signed_24(static_cast<std::int32_t>(from.signed_of(6, 3)));
  to.Unsigned_24(static_cast<std::uint32_t>(from.unsigned_of(7, 3)));
  to.Signed_32(static_cast<std::int32_t>(from.signed_of(8, 4)));
  to.Unsigned_32(static_cast<std::uint32_t>(from.unsigned_of(9, 4)));
  to.Signed_40(static_cast<std::int64_t>(from.signed_of(10, 5)));
  to.Unsigned_40(static_cast<std::uint64_t>(from.unsigned_of(11, 5)));
  to.Signed_48(static_cast<std::int64_t>(from.signed_of(12, 6)));
  to.Unsigned_48(static_cast<std::uint64_t>(from.unsigned_of(13, 6)));
  to.Signed_56(static_cast<std::int64_t>(from.signed_of(14, 7)));
  to.Unsigned_56(static_cast<std::uint64_t>(from.unsigned_of(15, 7)));
  to.Signed_64(static_cast<std::int64_t>(from.signed_of(16, 8)));
  to.Unsigned_64(static_cast<std::uint64_t>(from.unsigned_of(17, 8)));
  to.Real_64(std::bit_cast<double>(from.unsigned_of(18, 8)));
  to.Real_32_m_s(std::bit_cast<float>(static_cast<std::uint32_t>(from.unsigned_of(19, 4))));
  to.Visible(std::string(from.text_of(20)));
  to.Octets(from.octets_of(21));
  to.Unicode(std::string(from.text_of(22)));
  to.Time_of_day(static_cast<std::int64_t>(from.unsigned_of(23, 6)));
  to.Duration(static_cast<std::int64_t>(from.unsigned_of(24, 6)));
  to.Domain(from.octets_of(25));
}

void set_valid(std::uint64_t marks, plant::press_every_inputs_26c77fbdaf07453c_valid& to) {
  to.Flag((marks >> 0 & 1U) != 0);
  to.Second_flag((marks >> 1 & 1U) != 0);
  to.class_((marks >> 2 & 1U) != 0);
  to.n24V_supply((marks >> 3 & 1U) != 0);
  to.Signed_16((marks >> 4 & 1U) != 0);
  to.Unsigned_16((marks >> 5 & 1U) != 0);
  to.Signed_24((marks >> 6 & 1U) != 0);
  to.Unsigned_24((marks >> 7 & 1U) != 0);
  to.Signed_32((marks >> 8 & 1U) != 0);
  to.Unsigned_32((marks >> 9 & 1U) != 0);
  to.Signed_40((marks >> 10 & 1U) != 0);
  to.Unsigned_40((marks >> 11 & 1U) != 0);
  to.Signed_48((marks >> 12 & 1U) != 0);
  to.Unsigned_48((marks >> 13 & 1U) != 0);
  to.Signed_56((marks >> 14 & 1U) != 0);
  to.Unsigned_56((marks >> 15 & 1U) != 0);
  to.Signed_64((marks >> 16 & 1U) != 0);
  to.Unsigned_64((marks >> 17 & 1U) != 0);
  to.Real_64((marks >> 18 & 1U) != 0);
  to.Real_32_m_s((marks >> 19 & 1U) != 0);
  to.Visible((marks >> 20 & 1U) != 0);
  to.Octets((marks >> 21 & 1U) != 0);
  to.Unicode((marks >> 22 & 1U) != 0);
  to.Time_of_day((marks >> 23 & 1U) != 0);
  to.Duration((marks >> 24 & 1U) != 0);
  to.Domain((marks >> 25 & 1U) != 0);
}

class Course {
 public:
  Course() : type_(device_type()), plan_(type_, "types"), image_(type_), times_(type_.pdos.size()) {
    buffer_.resize(plan_.max_size());
    payload_.reserve(4096);
    sample_.gateway("types");
    sample_.line("press");
  }

  double by_plan() {
    return bench::median_time([this] {
             for (int i = 0; i < kSamples; ++i)
               size_ = plan_.write({1, ++number_, 2, 3, times_}, image_.snapshot, buffer_);
           }) /
           kSamples;
  }
  double generated() {
    return bench::median_time([this] {
             for (int i = 0; i < kSamples; ++i) {
               sample_.sequence_number(++number_);
               set_valid(image_.snapshot.valid[0], sample_.valid());
               set_values(image_, sample_.values());
               bench::require(code_.serialize(&sample_, &payload_), "the sample has no room");
             }
           }) /
           kSamples;
  }
  std::size_t size() const { return size_; }
  std::size_t members() const { return type_.members.size(); }

 private:
  named::DeviceType type_;
  named::SamplePlan plan_;
  Image image_;
  std::vector<std::int64_t> times_;
  std::vector<std::byte> buffer_;
  std::size_t size_ = 0;
  std::uint64_t number_ = 0;
  Sample sample_;
  SampleType code_;
  eprosima::fastrtps::rtps::SerializedPayload_t payload_;
};

}  // namespace

int main() {
  Course course;
  std::vector<Contestant> contestants;
  contestants.push_back({"peer: generated code", [&] { return course.generated(); }, {}});
  contestants.push_back({"plan", [&] { return course.by_plan(); }, {}});
  bench::interleave(contestants);
  bench::print_heading("Named sample of " + std::to_string(course.members()) + " members, " +
                       std::to_string(course.size()) + " octets");
  for (const Contestant& contestant : contestants)
    bench::print_figure(contestant, "ns");
  bench::print_target("plan beside generated code",
                      bench::median_ratio(contestants[1], contestants[0]), kMost, "x");
}
