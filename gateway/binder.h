// Values that one line passes on to another: outputs that follow inputs, across executors.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "gateway/config/plant.h"
#include "gateway/exchange/handover.h"
#include "gateway/exchange/wakeup.h"
#include "stack/line/line.h"

namespace linegate::gateway {

// All bindings from one line to another. The newest values of all of them are handed over together;
// who takes them does not wait for who gives them, nor the other way round.
struct BoundLink {
  explicit BoundLink(std::vector<config::Binding> bindings_of_two_lines);

  const std::vector<config::Binding> bindings;
  exchange::Handover<std::vector<line::Line::Input>> values;
  exchange::Wakeup* taker = nullptr;  // set before either line runs
};

// The end where the inputs are. Of the thread that runs the line.
class BoundSource {
 public:
  explicit BoundSource(BoundLink& link);

  // Hands over what has become another value, or (not) valid.
  void look(const line::Line& line);

 private:
  void find_entries(const line::Line& line);

  static constexpr std::uint32_t kNone = 0xFFFF'FFFF;

  BoundLink* link_;
  std::vector<std::uint32_t> entries_;  // by binding; an observer's layout changes
  std::vector<line::Line::Input> last_;
  std::uint64_t revision_ = 0;
  bool first_ = true;
};

// The end where the outputs are.
class BoundTarget {
 public:
  explicit BoundTarget(BoundLink& link);

  // Writes what was handed over and is another value than before. Nothing is written before an
  // input was valid for the first time; after that an input that is not valid any more keeps its
  // value, or is taken as 0 where its binding says so.
  void take(line::Line& line, Instant now);

 private:
  struct Written {
    std::uint64_t value = 0;
    bool any = false;
  };

  BoundLink* link_;
  std::vector<Written> written_;
  std::vector<line::BoundValue> changed_;
};

}  // namespace linegate::gateway
