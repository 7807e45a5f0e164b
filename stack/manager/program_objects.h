// SPDX-License-Identifier: Apache-2.0
// The expected software of the nodes in the manager's own object dictionary, as in CiA 302-2.
//
//   1F55h:n  U32     expected software identification of node n; 0 = none
//   1F58h:n  DOMAIN  program of node n, kept in memory; can be read only by SDO
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

// These objects, with the values of the plans in 1F55h.
std::vector<od::ObjectDescription> program_objects(std::span<const NodePlan> plans);

class ProgramObjects final : public od::Hook {
 public:
  // dictionary has all objects of program_objects(), or none of them, and must outlive this object.
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
  // Transfers in progress; several SDO servers may transfer the same program. Ended transfers are
  // removed when the next one begins.
  std::vector<std::unique_ptr<SharedSource>> sources_;
  std::vector<std::unique_ptr<Sink>> sinks_;
};

}  // namespace linegate::manager
