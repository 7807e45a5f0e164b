// SPDX-License-Identifier: Apache-2.0
// Selects the values of a line that the value history stores, and when.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "gateway/config/plant.h"
#include "gateway/journal/stored_value.h"
#include "gateway/runtime/clock.h"
#include "stack/base/time.h"
#include "stack/image/snapshot.h"

namespace linegate::gateway {

// Of an entry whose value changes, the newest value is stored at most once in min_interval, with
// the time of the snapshot in which it was first seen. The end of validity of a stored value is
// stored at once, after the newest value before it: so neither the last value of a burst nor that
// of a device that fails is lost, and no value is shown for a time in which the device did not have
// it. If the entry was valid between two stored values only, the last value of the newest such time
// is stored with its end. An entry has at most three stored values in min_interval. A call
// allocates nothing.
class ValueSampler {
 public:
  using Layouts = std::array<image::Layout, 2>;  // by image::Direction
  // Takes a value; false if there is no room for it now.
  using Store = std::function<bool(StoredValue)>;

  ValueSampler(const config::History& plan, const std::string& line, const Layouts& layouts);

  // Entries that the layouts do not have are invalid from now on.
  void use(const Layouts& layouts, Instant now);
  // The snapshot is of the present layout of its direction.
  void add(const image::Snapshot& snapshot);
  // Stores what is due. Returns when to call it again; kNever: after the next change. What finds no
  // room is tried again.
  Instant store_due(Instant now, const ClockMap& clock, const Store& store);
  // What is stored was lost: stores the present values again, with the times since when they hold.
  void repeat();
  // The line has ended: ends all values. False: there was no room for all, call it again.
  bool end(Instant now, const ClockMap& clock, const Store& store);

 private:
  struct Value {
    Instant time{};  // monotonic: since when
    od::DataType type = od::DataType::none;
    std::uint16_t bits = 1;
    std::optional<std::uint64_t> value;
    std::shared_ptr<const od::Scaling> scaling{};  // nullptr: none
  };
  // A time in which the entry was valid, and of which nothing was stored.
  struct Phase {
    Value last;
    Value end;
  };
  struct Place {
    std::size_t entry = 0;  // in its layout
    std::uint32_t bit_offset = 0;
    std::uint16_t bits = 1;
    od::DataType type = od::DataType::none;
    std::shared_ptr<const od::Scaling> scaling{};  // nullptr: none
  };
  struct Watched {
    std::shared_ptr<const ValueEntry> entry;
    std::optional<Place> place;  // nothing: the layout has no such entry
    Value newest;
    Value stored;
    // The end of the validity of `stored`, and the newest value before it, until they are stored.
    std::optional<Value> last;
    std::optional<Value> end;
    std::optional<Phase> phase;  // after them, and before `newest`
    Instant due{};               // of the next stored value
  };

  static bool is_same(const Value& a, const Value& b);
  static std::optional<std::uint64_t> value_of(const Place& of, const image::Snapshot& snapshot);
  void change(Watched& of, std::optional<std::uint64_t> to, Instant time);
  Instant store_due(Watched& of, Instant now, const ClockMap& clock, const Store& store);

  Duration min_interval_;
  std::vector<Watched> watched_;
  bool is_waiting_ = false;  // a value may differ from the stored one
};

}  // namespace linegate::gateway
