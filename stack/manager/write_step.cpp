#include "stack/manager/write_step.h"

#include <utility>

#include "stack/base/byte_order.h"

namespace linegate::manager {

void WriteStep::begin(StepContext& context, Instant now) {
  context_ = &context;
  write_ = 0;
  end_.reset();
  next(now);
}

void WriteStep::completed(const sdo::Completion& completion, Instant now) {
  if (completion.abort == AbortCode::none) {
    ++write_;
    next(now);
    return;
  }
  Event event{.time = now,
              .kind = EventKind::configuration_error,
              .node = context_->plan().id,
              .length = 3};
  event.code = static_cast<std::uint32_t>(completion.abort);
  store_le(event.data.data(), completion.address.index);
  event.data[2] = std::byte{completion.address.sub};
  events_.emit(event);
  end_ = StepEnd{.kind = StepEnd::Kind::failed,
                 .letter = 'J',
                 .finding = {.kind = BootFinding::Kind::abort,
                             .object = completion.address,
                             .abort = completion.abort}};
}

std::optional<StepEnd> WriteStep::take_end() {
  return std::exchange(end_, std::nullopt);
}

void WriteStep::next(Instant now) {
  const std::vector<ObjectWrite>& writes = context_->plan().writes;
  if (write_ >= writes.size()) {
    end_ = StepEnd{};
    return;
  }
  const ObjectWrite& write = writes[write_];
  context_->submit({.address = write.address,
                    .write = true,
                    .data = write.data,
                    .timeout = context_->sdo_timeout()},
                   now);
}

}  // namespace linegate::manager
