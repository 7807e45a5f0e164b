// SPDX-License-Identifier: Apache-2.0
#include "gateway/cli/problems_as_json.h"

#include <iostream>

#include "gateway/cli/usage_error.h"
#include "gateway/runtime/exit_code.h"

namespace linegate::gateway {
namespace {

// Records the text written to a standard stream while this object exists.
class RecordedOutput {
 public:
  explicit RecordedOutput(std::ostream& stream) : stream_(stream), recorded_(stream) {
    before_ = stream.rdbuf(recorded_.rdbuf());
  }
  ~RecordedOutput() { stream_.rdbuf(before_); }
  RecordedOutput(const RecordedOutput&) = delete;
  RecordedOutput& operator=(const RecordedOutput&) = delete;

  const std::string& text() const { return recorded_.text(); }

 private:
  std::ostream& stream_;
  RecordingStream recorded_;  // writes to the buffer that the stream had before
  std::streambuf* before_ = nullptr;
};

}  // namespace

int with_problems_as_json(bool json, const std::function<int()>& action) {
  if (!json) {
    return action();
  }
  int code = kExitOk;
  std::string problem;
  bool has_result = false;
  {
    const RecordedOutput errors(std::cerr);
    const RecordedOutput results(std::cout);
    code = action();
    problem = errors.text();
    has_result = !results.text().empty();
  }
  if (code == kExitUsage) {
    print_usage_error(std::cout, problem);
  } else if (code == kExitFailed && !has_result && !problem.empty()) {
    print_failure(std::cout, problem);
  }
  return code;
}

}  // namespace linegate::gateway
