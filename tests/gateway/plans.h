// SPDX-License-Identifier: Apache-2.0
// Lines for tests, created like those of the gateway.
#pragma once

#include <memory>
#include <string>
#include <utility>

#include <gtest/gtest.h>

#include "gateway/config/plant.h"
#include "stack/line/line.h"

#include "tests/paths.h"

namespace linegate::gateway {

// Where DDS runs in this program of tests.
struct PlaceOfDds {
  std::string process = "same";  // or `own`, of `dds: {process: ...}`
  std::string program;           // that is started; empty: the program that runs, which is a test
};
// dds_process_own.cpp, which is part of some programs, sets it before their first test.
inline PlaceOfDds& place_of_dds() {
  static PlaceOfDds place;
  return place;
}

// A plant from text. Device file names are relative to the root of the repository.
inline config::Plant make_plant(const std::string& text) {
  auto loaded = config::read(text, paths::in_repository("plant.yaml"));
  for (const auto& diagnostic : loaded.diagnostics) {
    ADD_FAILURE() << to_string(diagnostic);
  }
  if (loaded.value && place_of_dds().program.empty()) {
    loaded.value->dds_own_process = false;  // this program of tests is not started as one
  } else if (loaded.value) {
    loaded.value->dds_program = place_of_dds().program;
    loaded.value->dds_stable = Duration::zero();  // no pauses between deaths
  }
  return loaded.value ? std::move(*loaded.value) : config::Plant{};
}

inline std::unique_ptr<line::Line> make_line(const config::LinePlan& plan) {
  auto made = line::Line::make(plan.config);
  return made.value ? std::move(*made.value) : nullptr;
}

}  // namespace linegate::gateway
