// SPDX-License-Identifier: Apache-2.0
// The thread that answers requests for pages of the journal, so that neither a line nor the
// publisher nor the thread that writes the journal waits for them.
#pragma once

#include <chrono>
#include <mutex>
#include <string>
#include <thread>

#include "bridges/request/request.h"
#include "gateway/exchange/cell.h"
#include "gateway/exchange/ring.h"
#include "gateway/exchange/wakeup.h"
#include "gateway/journal/journal_pages.h"
#include "stack/line/command.h"

namespace linegate::gateway {

// The reply with that refusal and a sentence.
line::Reply refused_page(std::uint64_t tag, const PageRefusal& refusal);

class JournalServer {
 public:
  static constexpr std::size_t kOfOneClient = 32;  // requests that wait
  // A thread that waits for the disk longer is given up at the end.
  static constexpr auto kLongestStop = std::chrono::seconds(1);

  // replies, answered: of the publisher; the second is signalled after a push to the first. Both
  // must outlive this object.
  JournalServer(std::string file, exchange::Ring<line::Reply>& replies, exchange::Wakeup& answered);
  // Waits for the thread without limit.
  ~JournalServer();
  JournalServer(const JournalServer&) = delete;
  JournalServer& operator=(const JournalServer&) = delete;

  // Does nothing if the thread runs.
  void start();
  // Answers the requests that wait with Refusal::cancelled. Call it while the publisher runs, and
  // the request receiver does not. False: the thread still waits for the disk after kLongestStop.
  // This object must then exist until the process ends.
  bool stop();

  // --- request receiver ---

  // JournalRead alone. Call signal() after a push.
  exchange::Ring<request::GatewayCommand>& requests() { return requests_; }
  void signal() { wakeup_.signal(); }

 private:
  void run();
  line::Reply answer(const request::GatewayCommand& command);
  void push(line::Reply reply);
  bool try_push(line::Reply& reply);

  JournalPages pages_;
  exchange::Ring<line::Reply>& replies_;
  exchange::Wakeup& answered_;
  exchange::Ring<request::GatewayCommand> requests_{2 * kOfOneClient};
  exchange::Wakeup wakeup_;
  exchange::Flag stop_;
  exchange::Flag ended_;
  std::mutex given_up_mutex_;
  bool given_up_ = false;  // replies_ and answered_ may not exist any more
  std::thread thread_;
};

}  // namespace linegate::gateway
