// SPDX-License-Identifier: Apache-2.0
// Received PDO -> image: detection of changes; valid, dirty and time marks. 8 bytes to 4 entries,
// frames in batches of 64, 4096 frames in seeded random order, half of the bytes changing, with
// deadlines. The floor (pdo_to_image_floor.h) runs in the same program. Figures are per frame.
//
//   bench_pdo_to_image --benchmark_repetitions=30 --benchmark_enable_random_interleaving=true
//     --benchmark_report_aggregates_only=true
#include <memory>
#include <vector>

#include <benchmark/benchmark.h>

#include "stack/image/process_image.h"
#include "stack/pdo/engine.h"
#include "stack/pdo/link.h"

#include "tests/bench/allocations.h"
#include "tests/bench/pdo_line.h"
#include "tests/bench/pdo_to_image_floor.h"

namespace {

using namespace linegate;

constexpr std::size_t kFrames = 4096;
constexpr std::size_t kBatch = 64;
constexpr std::uint16_t kSource = 0x6000;

enum Variant : std::int64_t { kEventDriven, kSynchronous, kBits };

// A device with 4 x UNSIGNED16, or 64 x BOOLEAN, in 6000h.
od::DeviceDescription device(Variant variant) {
  od::DeviceDescription description;
  od::ObjectDescription object;
  object.index = kSource;
  object.name = "Value";
  object.type = od::ObjectType::array;
  const int count = variant == kBits ? 64 : 4;
  for (int sub = 1; sub <= count; ++sub) {
    object.variables.push_back(
        {.sub = static_cast<std::uint8_t>(sub),
         .name = "Value " + std::to_string(sub),
         .type = variant == kBits ? od::DataType::boolean : od::DataType::unsigned16,
         .access = od::Access::ro,
         .mappable = true});
  }
  description.objects.push_back(object);
  return description;
}

// Nodes with 8 PDOs each.
std::vector<pdo::RemoteNode> nodes(Variant variant, const od::DeviceDescription& device,
                                   const std::vector<std::uint32_t>& ids) {
  std::vector<pdo::RemoteNode> nodes;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    if (i % 8 == 0) {
      nodes.push_back({.id = static_cast<std::uint8_t>(nodes.size() + 1),
                       .name = "n" + std::to_string(nodes.size() + 1),
                       .device = &device,
                       .deadline = std::chrono::milliseconds(100)});
    }
    pdo::Parameters tpdo;
    tpdo.number = static_cast<std::uint16_t>(i % 8 + 1);
    tpdo.cob_id = {ids[i]};
    tpdo.type = variant == kSynchronous ? 1 : 255;
    for (const od::VariableDescription& variable : device.objects[0].variables) {
      tpdo.mapping.push_back(
          {{kSource, variable.sub}, static_cast<std::uint8_t>(variant == kBits ? 1 : 16)});
    }
    nodes.back().pdos.tpdos.push_back(tpdo);
  }
  return nodes;
}

void stamp(std::vector<can::Frame>& frames, Instant& now) {
  for (can::Frame& frame : frames) {
    now += std::chrono::microseconds(1);
    frame.time = now;
  }
}

struct Receiver {
  Receiver(Variant variant, const std::vector<std::uint32_t>& ids) : description(device(variant)) {
    const pdo::LinkPlan plan = *pdo::plan_links(nodes(variant, description, ids)).value;
    image = std::make_unique<image::ProcessImage>(plan.inputs, plan.outputs);
    (void)pdo::add_linked_objects(dictionary, *image, plan);
    engine = std::make_unique<pdo::Engine>(dictionary, dispatch, events, image.get());
    engine->link(plan);
    engine->configure();
    engine->set_operational(true, Instant{});
  }

  void receive(std::span<const can::Frame> batch) {
    while (!batch.empty()) {
      batch = batch.subspan(engine->receive_ordinary(batch, traffic));
      if (!batch.empty()) {
        engine->receive(dispatch.find(batch.front())->index, batch.front());
        batch = batch.subspan(1);
      }
    }
  }

  od::DeviceDescription description;
  std::unique_ptr<image::ProcessImage> image;
  od::Dictionary dictionary;
  can::Dispatch dispatch;
  EventLog events;
  std::unique_ptr<pdo::Engine> engine;
  can::Traffic traffic;
};

void per_frame(benchmark::State& state, std::uint64_t allocated) {
  const auto count = static_cast<double>(state.iterations()) * kBatch;
  state.SetItemsProcessed(static_cast<std::int64_t>(count));
  state.counters["per_frame"] =
      benchmark::Counter(count, benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
  state.counters["allocations"] = static_cast<double>(allocated);
}

void pdo_to_image(benchmark::State& state) {
  const auto variant = static_cast<Variant>(state.range(1));
  const std::vector<std::uint32_t> ids =
      bench::pdo_identifiers(static_cast<std::size_t>(state.range(0)));
  Receiver receiver(variant, ids);
  std::vector<can::Frame> input = bench::pdo_frames(ids, kFrames);
  Instant now{};
  stamp(input, now);
  receiver.receive(input);
  std::size_t at = 0;
  const std::uint64_t allocated = bench::allocations();
  for (auto _ : state) {
    receiver.receive(std::span(input).subspan(at, kBatch));
    if (variant == kSynchronous) {
      receiver.engine->sync(0, input[at + kBatch - 1].time);
    }
    at = (at + kBatch) % kFrames;
  }
  per_frame(state, bench::allocations() - allocated);
  benchmark::DoNotOptimize(receiver.image->bytes(image::Direction::inputs).data());
}

void floor_of_it(benchmark::State& state) {
  const std::vector<std::uint32_t> ids =
      bench::pdo_identifiers(static_cast<std::size_t>(state.range(0)));
  bench::Floor floor(ids);
  std::vector<can::Frame> input = bench::pdo_frames(ids, kFrames);
  Instant now{};
  stamp(input, now);
  std::size_t at = 0;
  const std::uint64_t allocated = bench::allocations();
  for (auto _ : state) {
    benchmark::DoNotOptimize(floor.receive(std::span(input).subspan(at, kBatch)));
    at = (at + kBatch) % kFrames;
  }
  per_frame(state, bench::allocations() - allocated);
  benchmark::DoNotOptimize(floor.checksum());
}

BENCHMARK(floor_of_it)->ArgName("pdos")->Arg(1)->Arg(64)->Arg(512);
BENCHMARK(pdo_to_image)
    ->ArgNames({"pdos", "variant"})
    ->ArgsProduct({{1, 64, 512}, {kEventDriven, kSynchronous, kBits}});

}  // namespace

BENCHMARK_MAIN();
