// SPDX-License-Identifier: Apache-2.0
// Several hooks of one object combined into one; private to stack/od. All are checked before any is
// informed.
#pragma once

#include <vector>

#include "stack/od/hook.h"

namespace linegate::od {

class HookChain final : public Hook {
 public:
  explicit HookChain(Hook* first) : first_(first) {}

  // The hook of set_hook(), which is called first; may be nullptr.
  Hook* first() const { return first_; }
  void set_first(Hook* hook);
  void add(Hook* hook, Watch watch) { others_.push_back({hook, watch}); }
  // Returns false if the hook is not in the chain.
  bool remove(Hook* hook);
  bool has_others() const { return !others_.empty(); }
  bool watches_rpdos() const;

  // The first refusal, else kLater if one hook returned that. Returns device_incompatible if two
  // did, because there is only one ticket.
  AbortCode before_read(Address address, const Variable& variable) override;
  AbortCode check_write(Address address, std::span<const std::byte> value) override;
  // Calls the hooks in order, until one refuses.
  AbortCode execute_write(Address address, std::span<const std::byte> value) override;
  void written(Address address) override;
  void came_by_rpdo(Address address) override;
  // The first stream, refusal or kLater that a hook returns.
  Result<ByteSource*> open_source(Address address) override;
  Result<ByteSink*> open_sink(Address address, std::optional<std::uint32_t> size) override;

  // The hook that returned kLater in the last access.
  Hook* deferring() const { return deferring_; }
  // The hook that returned the last source (sink), or kLater instead of one.
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
