// SPDX-License-Identifier: Apache-2.0
// Several hooks of one object as one; private to stack/od. All are asked before any is told.
#pragma once

#include <vector>

#include "stack/od/hook.h"

namespace linegate::od {

class HookChain final : public Hook {
 public:
  explicit HookChain(Hook* first) : first_(first) {}

  // The one that set_hook() sets, which is asked and told first; may be nullptr.
  Hook* first() const { return first_; }
  void set_first(Hook* hook);
  void add(Hook* hook, Watch watch) { others_.push_back({hook, watch}); }
  // False if it was not there.
  bool remove(Hook* hook);
  bool has_others() const { return !others_.empty(); }
  bool watches_rpdos() const;

  // The first refusal, else kLater if one of them answered that. Only one may:
  // device_incompatible if there are two, for there is one ticket.
  AbortCode before_read(Address address, const Variable& variable) override;
  AbortCode check_write(Address address, std::span<const std::byte> value) override;
  // In order, until one refuses.
  AbortCode execute_write(Address address, std::span<const std::byte> value) override;
  void written(Address address) override;
  void came_by_rpdo(Address address) override;
  // The first stream that one of them gives, or its refusal, or kLater.
  Result<ByteSource*> open_source(Address address) override;
  Result<ByteSink*> open_sink(Address address, std::optional<std::uint32_t> size) override;

  // Who answered kLater in the last access.
  Hook* deferring() const { return deferring_; }
  // Who gave the last source (sink), or answered kLater when it was asked for one.
  Hook* opener(bool of_sink) const;

 private:
  struct Other {
    Hook* hook = nullptr;
    Watch watch = Watch::writes;
  };

  template <class Ask>
  AbortCode ask_all(Ask ask);
  template <class Stream, class Open>
  Result<Stream*> first_stream(Hook*& opener, Open open);
  void forget(const Hook* hook);

  Hook* first_;
  std::vector<Other> others_;
  Hook* deferring_ = nullptr;
  Hook* source_opener_ = nullptr;
  Hook* sink_opener_ = nullptr;
};

}  // namespace linegate::od
