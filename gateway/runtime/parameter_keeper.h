// SPDX-License-Identifier: Apache-2.0
// A thread that waits for disks, for those who must not: a line gives it what its own node stores
// (CiA 301, 1010h), goes on, and is woken when the file has it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "gateway/exchange/cell.h"
#include "gateway/exchange/ring.h"
#include "gateway/exchange/wakeup.h"
#include "gateway/runtime/parameter_file.h"
#include "stack/storage/medium.h"

namespace linegate::gateway {

// One file as the thread of its line sees it.
class KeptFile final : public storage::Medium {
 public:
  KeptFile(std::string path, exchange::Wakeup& keeper, exchange::Wakeup& line, FileCalls& calls);

  // Waits for the disk: when the line begins, and never while something is to be kept.
  bool read(std::vector<std::byte>& image) override { return file_.read(image); }
  // False if the keeper has something of this line still.
  bool keep(std::span<const std::byte> image) override;
  bool slow() const override { return true; }
  // How the last keep() ended, once; nothing before it has.
  std::optional<bool> take_result();

  // By the keeper's thread: keeps what there is to keep, and wakes the line.
  void work();

 private:
  ParameterFile file_;
  exchange::Wakeup& keeper_;
  exchange::Wakeup& line_;
  exchange::Ring<std::vector<std::byte>> images_{2};
  exchange::Ring<char> results_{2};  // 1 = kept
  bool busy_ = false;                // the line's view
};

// The file of one node of a line; see line::Line::set_medium().
struct NodeStorage {
  std::uint8_t device = 0;  // as of line::Line::set_medium()
  KeptFile* file = nullptr;
};

class ParameterKeeper {
 public:
  ~ParameterKeeper() { stop(); }

  // While it is stopped. line is woken when there is a result; both must outlive the keeper.
  KeptFile& add(const std::string& path, exchange::Wakeup& line,
                FileCalls& calls = FileCalls::system());
  // While it is stopped, when the line has gone.
  void remove(const KeptFile& file);
  // May be started again after stop().
  void start();
  // Keeps what it was given before.
  void stop();

 private:
  void run();

  exchange::Wakeup wakeup_;
  exchange::Flag stop_;
  std::vector<std::unique_ptr<KeptFile>> files_;
  std::thread thread_;
};

}  // namespace linegate::gateway
