// SPDX-License-Identifier: Apache-2.0
// A link of the client library whose samples are an input: those that bridges/dds may pass to the
// library, however little they fit together. Promise: no output is written but of an armed group,
// with the layout and the start of the gateway that its values were set for.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

#include "bridges/client/client.h"
#include "stack/base/time.h"

#include "tests/fuzz/input.h"

namespace linegate::fuzz {

// Few names, so that samples meet.
inline const std::string kNames[] = {"a", "inputs:a", "outputs:a", "b", "", "outputs:"};

template <class T, std::size_t N>
const T& one_of(Input& in, const T (&all)[N]) {
  return all[in.byte() % N];
}

// Mostly small numbers, and the ends of the range.
std::uint64_t number(Input& in);

struct ClientWorld {
  explicit ClientWorld(Input& the_input) : in(the_input) {}
  Input& in;
  Instant now{std::chrono::seconds(100)};
  std::uint64_t sent = 0;
  std::uint64_t written = 0;
  bool armed = false;  // since then a group may be written
};

client::Client client_of(const std::shared_ptr<ClientWorld>& world);

}  // namespace linegate::fuzz
