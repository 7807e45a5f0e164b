// SPDX-License-Identifier: Apache-2.0
// Lines for tests, created like those of the gateway.
#pragma once

#include <memory>
#include <string>
#include <utility>

#include <gtest/gtest.h>

#include "gateway/config/plant.h"
#include "stack/line/line.h"

namespace linegate::gateway {

// Where DDS runs: `same` or `own`, for `dds: {process: ...}`. A program of tests is built for each.
#ifndef LINEGATE_TEST_DDS_PROCESS
#define LINEGATE_TEST_DDS_PROCESS "same"
#endif

// A plant from text. Device file names are relative to the root of the repository.
inline config::Plant make_plant(const std::string& text) {
  auto loaded = config::read(text, LINEGATE_SOURCE_DIR "/plant.yaml");
  for (const auto& diagnostic : loaded.diagnostics) {
    ADD_FAILURE() << to_string(diagnostic);
  }
#ifdef LINEGATED
  if (loaded.value) {
    loaded.value->dds_program = LINEGATED;  // by default the program that runs, which is a test
    loaded.value->dds_stable = Duration::zero();  // no pauses between deaths
  }
#endif
  return loaded.value ? std::move(*loaded.value) : config::Plant{};
}

inline std::unique_ptr<line::Line> make_line(const config::LinePlan& plan) {
  auto made = line::Line::make(plan.config);
  return made.value ? std::move(*made.value) : nullptr;
}

}  // namespace linegate::gateway
