// SPDX-License-Identifier: Apache-2.0
#include "stack/line/srdo_reception.h"

#include <algorithm>

#include "stack/image/layout.h"
#include "stack/line/srdo_plan.h"
#include "stack/manager/pdo_check.h"

namespace linegate::line {

SrdoReception::SrdoReception(can::Dispatch& dispatch, EventLog& events, const LineConfig& config)
    : consumer_(dispatch, events, *this, srdo_sources(config)),
      parameters_(srdo_parameters(config)),
      differing_(parameters_.size()) {
}

bool SrdoReception::receive(std::uint16_t target, const can::Frame& frame) {
  return differing_[srdo::Consumer::source_of(target)].empty() && consumer_.receive(target, frame);
}

void SrdoReception::learn(std::uint8_t node, od::Address address,
                          std::span<const std::byte> value) {
  for (std::size_t i = 0; i < parameters_.size(); ++i) {
    const auto expected =
        std::ranges::find(parameters_[i], address, &manager::ObjectWrite::address);
    if (consumer_.sources()[i].node != node || expected == parameters_[i].end()) {
      continue;
    }
    if (manager::is_same_parameter(address, expected->data, value)) {
      differing_[i].erase(address);
    } else {
      differing_[i].insert(address);
      consumer_.forget(i);
    }
  }
}

void SrdoReception::connect(pdo::Engine& engine, image::ProcessImage& image,
                            std::span<const pdo::LinkedPdo> rpdos) {
  engine_ = &engine;
  image_ = &image;
  rpdos_.clear();
  for (const srdo::Source& source : consumer_.sources()) {
    const auto number = static_cast<std::uint16_t>(image::kFirstSrdo + source.number - 1);
    const auto found = std::ranges::find_if(rpdos, [&](const pdo::LinkedPdo& pdo) {
      return pdo.node == source.node && pdo.remote_pdo == number;
    });
    rpdos_.push_back(found == rpdos.end() ? std::uint16_t{0} : found->parameters.number);
  }
}

void SrdoReception::forget(std::uint8_t node) {
  for (std::size_t i = 0; i < consumer_.sources().size(); ++i) {
    if (consumer_.sources()[i].node == node) {
      consumer_.forget(i);
    }
  }
}

void SrdoReception::check_signature(std::uint8_t node, std::uint8_t number, std::uint16_t found,
                                    Instant now) {
  for (std::size_t i = 0; i < sources().size(); ++i) {
    if (sources()[i].node == node && sources()[i].number == number) {
      consumer_.check_signature(i, found, now);
    }
  }
}

void SrdoReception::forget_all() {
  for (std::size_t i = 0; i < consumer_.sources().size(); ++i) {
    consumer_.forget(i);
  }
}

SrdoCounters SrdoReception::counters() const {
  SrdoCounters out{.pairs = consumer_.counters().pairs, .faults = consumer_.counters().faults};
  for (std::size_t i = 0; i < consumer_.sources().size(); ++i) {
    ++out.received;
    if (consumer_.fault(i) == srdo::Fault::none) {
      ++out.valid;
    }
  }
  return out;
}

void SrdoReception::srdo_received(std::size_t source, const can::Frame& normal) {
  if (const std::uint16_t rpdo = rpdos_[source]; rpdo != 0) {
    engine_->receive(static_cast<std::uint16_t>(rpdo - 1U), normal);
  }
}

void SrdoReception::srdo_unsafe(std::size_t source) {
  if (const std::uint16_t rpdo = rpdos_[source]; rpdo != 0) {
    image_->set_pdo_valid(image::Direction::inputs, rpdo, false);
  }
}

}  // namespace linegate::line
