// SPDX-License-Identifier: Apache-2.0
// The thread that waits for disks, so that no executor has to: a line hands over the parameters
// that its own node stores (CiA 301, 1010h), continues, and is woken when the file is written.
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

// The stored parameters of one node, used by the thread of its line.
class StoredParameters final : public storage::Medium {
 public:
  // path: of the file, in a folder that exists. keep() signals `storage`, write_pending() signals
  // `line`. Both must outlive this object.
  StoredParameters(std::string path, exchange::Wakeup& storage, exchange::Wakeup& line,
                   FileCalls& calls);

  // Blocks on the disk: called when the line starts, never while a write is pending.
  bool read(std::vector<std::byte>& image) override { return file_.read(image); }
  // Queues the image for the storage thread. Returns false while an earlier write is pending.
  bool keep(std::span<const std::byte> image) override;
  bool slow() const override { return true; }
  // Returns the result of the last keep() once; nothing while the write is pending.
  std::optional<bool> pop_result();

  // Called by the storage thread: writes the queued image and wakes the line.
  void write_pending();

 private:
  ParameterFile file_;
  exchange::Wakeup& storage_;
  exchange::Wakeup& line_;
  exchange::Ring<std::vector<std::byte>> images_{2};
  exchange::Ring<char> results_{2};  // 1 = written
  bool busy_ = false;                // from keep() to pop_result()
};

// The stored parameters of one node of a line.
struct NodeStorage {
  line::ParameterSet of;
  StoredParameters* file = nullptr;
};

class StorageThread {
 public:
  ~StorageThread() { stop(); }

  // Call it while the thread is stopped. line is woken when there is a result; both must outlive
  // this object.
  StoredParameters& add(const std::string& path, exchange::Wakeup& line,
                        FileCalls& calls = FileCalls::system());
  // Call it while the thread is stopped, after the line was removed.
  void remove(const StoredParameters& file);
  // May be started again after stop().
  void start();
  // Writes the queued images first.
  void stop();

 private:
  void run();

  exchange::Wakeup wakeup_;
  exchange::Flag stop_;
  std::vector<std::unique_ptr<StoredParameters>> files_;
  std::thread thread_;
};

}  // namespace linegate::gateway
