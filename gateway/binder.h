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

class LineRunner;

// All bindings from one line to another. The newest values of all of them are handed over together,
// so that what came in one PDO stays together; who takes them does not wait for who gives them, nor
// the other way round. On one executor the hand-over is a call.
struct BoundLink {
  explicit BoundLink(std::vector<config::Binding> bindings_of_two_lines);

  const std::vector<config::Binding> bindings;
  exchange::Handover<std::vector<line::Line::Input>> values;
  // Who is to take them, set before either line runs. On the executor of the giving line its
  // runner, which is called; else the executor to be woken.
  LineRunner* runner = nullptr;
  exchange::Wakeup* taker = nullptr;
};

// The end where the inputs are. Of the thread that runs the line.
class BoundSource {
 public:
  explicit BoundSource(BoundLink& link);

  // Hands over what has become another value, or (not) valid, or of what is forwarded: what came
  // once more. now: for the runner that is called.
  void look(const line::Line& line, Instant now);

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

  // Writes what was handed over and is another value than before or, forwarded, came once more.
  // Nothing is written before an input was valid for the first time; when it is lost after that,
  // its binding says what becomes of the output. True if anything was written.
  bool take(line::Line& line, Instant now);

  const BoundLink& link() const { return *link_; }

 private:
  struct Written {
    std::uint64_t value = 0;
    Instant received{};
    bool any = false;
    bool valid = false;
  };
  void consider(const config::Binding& binding, const line::Line::Input& input, Written& written);

  BoundLink* link_;
  std::vector<Written> written_;
  std::vector<line::BoundValue> changed_;
};

}  // namespace linegate::gateway
