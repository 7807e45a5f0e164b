// SPDX-License-Identifier: Apache-2.0
#include "stack/manager/program_objects.h"

#include <utility>

#include "stack/base/assert.h"
#include "stack/base/byte_order.h"
#include "stack/manager/network_list.h"
#include "stack/od/objects.h"
#include "stack/od/stream.h"

namespace linegate::manager {

// Replaces the program when all data have been received.
class ProgramObjects::Sink final : public od::ByteSink {
 public:
  explicit Sink(SharedBytes& target) : target_(target) {}

  AbortCode write(std::span<const std::byte> piece) override {
    if (piece.size() > kLongestProgram - bytes_.size()) {
      return AbortCode::out_of_memory;
    }
    bytes_.insert(bytes_.end(), piece.begin(), piece.end());
    return AbortCode::none;
  }
  AbortCode finish() override {
    target_ = std::make_shared<const std::vector<std::byte>>(std::exchange(bytes_, {}));
    ended_ = true;
    return AbortCode::none;
  }
  void cancelled(AbortCode /*why*/) override {
    bytes_ = {};
    ended_ = true;
  }
  bool has_ended() const { return ended_; }
  bool rewind() override {
    bytes_.clear();
    return true;
  }

 private:
  SharedBytes& target_;
  std::vector<std::byte> bytes_;
  bool ended_ = false;
};

std::vector<od::ObjectDescription> program_objects(std::span<const NodePlan> plans) {
  std::vector<od::ObjectDescription> out{
      node_array(od::objects::kExpectedSoftware, od::Access::rw),
      node_array(od::objects::kNodeProgram, od::Access::rw),
  };
  for (const NodePlan& plan : plans) {
    store_le(std::span(out[0].variables[plan.id].value), plan.software);
  }
  return out;
}

ProgramObjects::ProgramObjects(od::Dictionary& dictionary, std::span<const NodePlan> plans)
    : dictionary_(dictionary) {
  for (const NodePlan& plan : plans) {
    programs_[plan.id] = plan.program;
  }
  LINEGATE_ASSERT(dictionary_.set_hook(od::objects::kNodeProgram, this).ok(), "the object exists");
}

ProgramObjects::~ProgramObjects() {
  LINEGATE_ASSERT(dictionary_.set_hook(od::objects::kNodeProgram, nullptr).ok(),
                  "the object exists");
}

std::uint32_t ProgramObjects::expected(std::uint8_t node) const {
  return static_cast<std::uint32_t>(
      dictionary_.number({od::objects::kExpectedSoftware, node}).value_or(0));
}

Result<od::ByteSource*> ProgramObjects::open_source(od::Address address) {
  if (programs_[address.sub] == nullptr) {
    return to_error(AbortCode::no_data);
  }
  std::erase_if(sources_, [](const auto& source) { return source->is_closed(); });
  return sources_.emplace_back(std::make_unique<SharedSource>(programs_[address.sub])).get();
}

Result<od::ByteSink*> ProgramObjects::open_sink(od::Address address,
                                                std::optional<std::uint32_t> size) {
  if (size.value_or(0) > kLongestProgram) {
    return to_error(AbortCode::out_of_memory);
  }
  std::erase_if(sinks_, [](const auto& sink) { return sink->has_ended(); });
  return sinks_.emplace_back(std::make_unique<Sink>(programs_[address.sub])).get();
}

// A write of the whole value by the owner of the dictionary: moves it here, so that it is stored
// only once.
void ProgramObjects::written(od::Address address) {
  const auto domain = dictionary_.find(address);
  if (domain && domain->size != 0) {
    const auto bytes = domain->bytes();
    programs_[address.sub] =
        std::make_shared<const std::vector<std::byte>>(bytes.begin(), bytes.end());
    dictionary_.set(address, std::span<const std::byte>{});
  }
}

}  // namespace linegate::manager
