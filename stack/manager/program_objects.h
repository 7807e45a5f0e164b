// SPDX-License-Identifier: Apache-2.0
// What the nodes are to run, where CiA 302-2 has it: in the manager's own object dictionary.
//
//   1F55h:n  U32     expected software identification of node n; 0 = none
//   1F58h:n  DOMAIN  program of node n, kept in memory; read over SDO alone
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "stack/manager/plan.h"
#include "stack/manager/program_run.h"
#include "stack/manager/shared_source.h"
#include "stack/od/dictionary.h"

namespace linegate::manager {

inline constexpr std::size_t kLongestProgram = std::size_t{16} * 1024 * 1024;  // bytes

// These objects, with what the plans say of 1F55h.
std::vector<od::ObjectDescription> program_objects(std::span<const NodePlan> plans);

class ProgramObjects final : public od::Hook {
 public:
  // dictionary has program_objects() or none of them, and must outlive it.
  ProgramObjects(od::Dictionary& dictionary, std::span<const NodePlan> plans);
  ~ProgramObjects() override;

  std::uint32_t expected(std::uint8_t node) const;
  // nullptr if there is none.
  const SharedBytes& program(std::uint8_t node) const { return programs_[node]; }

  // od::Hook
  Result<od::ByteSource*> open_source(od::Address address) override;
  Result<od::ByteSink*> open_sink(od::Address address, std::optional<std::uint32_t> size) override;
  void written(od::Address address) override;

 private:
  class Sink;

  od::Dictionary& dictionary_;
  std::array<SharedBytes, 128> programs_;  // by node-ID
  // Transfers under way, of several SDO servers perhaps with the same program; those that ended
  // stay until the next begins.
  std::vector<std::unique_ptr<SharedSource>> sources_;
  std::vector<std::unique_ptr<Sink>> sinks_;
};

}  // namespace linegate::manager
