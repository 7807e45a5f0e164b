// SPDX-License-Identifier: Apache-2.0
// The thread that waits for disks, so that no executor has to: a line hands over what its own node
// stores (CiA 301, 1010h), continues, and is woken when the file is written.
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
#include "stack/line/line.h"
#include "stack/storage/medium.h"

namespace linegate::gateway {

// The stored parameters of one node, as the thread of its line uses them.
class StoredParameters final : public storage::Medium {
 public:
  // path: of the file, in a folder that exists. storage is signalled by keep(), line by
  // write_pending(). All must outlive this.
  StoredParameters(std::string path, exchange::Wakeup& storage, exchange::Wakeup& line,
                   FileCalls& calls);

  // Waits for the disk: when the line begins, and never while something is to be written.
  bool read(std::vector<std::byte>& image) override { return file_.read(image); }
  // Queues the image for the storage thread. False while an earlier one is not written.
  bool keep(std::span<const std::byte> image) override;
  bool slow() const override { return true; }
  // How the last keep() ended, once; nothing while it is being written.
  std::optional<bool> pop_result();

  // By the storage thread: writes what is queued, and wakes the line.
  void write_pending();

 private:
  ParameterFile file_;
  exchange::Wakeup& storage_;
  exchange::Wakeup& line_;
  exchange::Ring<std::vector<std::byte>> images_{2};
  exchange::Ring<char> results_{2};  // 1 = written
  bool busy_ = false;                // as the line sees it
};

// The stored parameters of one node of a line.
struct NodeStorage {
  line::ParameterSet of;
  StoredParameters* file = nullptr;
};

class StorageThread {
 public:
  ~StorageThread() { stop(); }

  // While it is stopped. line is woken when there is a result; both must outlive this.
  StoredParameters& add(const std::string& path, exchange::Wakeup& line,
                        FileCalls& calls = FileCalls::system());
  // While it is stopped, when the line has gone.
  void remove(const StoredParameters& file);
  // May be started again after stop().
  void start();
  // Writes what was queued before.
  void stop();

 private:
  void run();

  exchange::Wakeup wakeup_;
  exchange::Flag stop_;
  std::vector<std::unique_ptr<StoredParameters>> files_;
  std::thread thread_;
};

}  // namespace linegate::gateway
