// SPDX-License-Identifier: Apache-2.0
// Compiles PDO records and links into copy plans.
#include "stack/od/description.h"
#include "stack/od/objects.h"
#include "stack/pdo/engine_impl.h"

namespace linegate::pdo {
namespace {

std::string hex_of_four(std::uint32_t value) {
  constexpr std::string_view kDigits = "0123456789ABCDEF";
  std::string text(4, '0');
  for (std::size_t i = 4; i-- > 0; value >>= 4U) {
    text[i] = kDigits[value & 0xFU];
  }
  return text + "h";
}

std::string describe_refusal(const Mapping& mapping, AbortCode why) {
  return od::to_text(mapping.address) + " with " + std::to_string(mapping.bits) +
         " bits: " + std::string(describe(why));
}

image::Direction direction_of(PdoKind kind) {
  return kind == PdoKind::rpdo ? image::Direction::inputs : image::Direction::outputs;
}

}  // namespace

AbortCode Engine::Impl::check_write(od::Address address, std::span<const std::byte> value) {
  return check_record_write(dictionary, address, value, 8 * max_bytes);
}

void Engine::Impl::written(od::Address address) {
  if (is_scanner_list(address.index)) {
    renew_revision();
    read_scanner_list();
    follow_sources();
    return;
  }
  if (is_dispatcher_list(address.index)) {
    read_dispatcher_list();
    return;
  }
  const std::optional<RecordIndex> record = record_index(address.index);
  const std::size_t count = record && record->kind == PdoKind::rpdo ? rpdos.size() : tpdos.size();
  if (!record || record->number > count) {
    return;
  }
  compile(record->kind, record->number);
  lay_out();
  if (operational) {
    begin(record->kind, static_cast<std::uint16_t>(record->number - 1U));
  }
}

std::vector<Diagnostic> Engine::Impl::configure() {
  stop_all();
  forget_sources();
  hook_records(this);
  const std::size_t rpdo_count = highest_number(PdoKind::rpdo);
  const std::size_t tpdo_count = highest_number(PdoKind::tpdo);
  rpdos.assign(rpdo_count, {});
  details.assign(rpdo_count, {});
  shadows.reset(rpdo_count);
  tpdos.assign(tpdo_count, {});
  reported_rpdos.assign(rpdo_count, {});
  reported_tpdos.assign(tpdo_count, {});
  inputs->grow_pdos(rpdo_count);
  outputs->grow_pdos(tpdo_count);
  long_shadows.clear();
  affected.reset(tpdo_count);
  held_changed.reset(tpdo_count);
  unacknowledged.reset(tpdo_count);
  under_way.assign(tpdo_count, {});
  held_always.reset(tpdo_count);
  asked.reset(rpdo_count);
  timers.reset(rpdo_count + tpdo_count);
  read_scanner_list();
  read_dispatcher_list();
  std::vector<Diagnostic> diagnostics;
  for (const PdoKind kind : {PdoKind::rpdo, PdoKind::tpdo}) {
    const std::size_t count = kind == PdoKind::rpdo ? rpdo_count : tpdo_count;
    for (std::size_t number = 1; number <= count; ++number) {
      const Problem problem = compile(kind, static_cast<std::uint16_t>(number));
      if (problem.why != AbortCode::none) {
        diagnostics.push_back({.text = std::string(name(kind)) + " " + std::to_string(number) +
                                       " is not used: " + problem.text});
      }
    }
  }
  lay_out();
  if (std::exchange(operational, false)) {
    set_operational(true, latest);
  }
  return diagnostics;
}

const LinkedPdo* Engine::Impl::linked(PdoKind kind, std::uint16_t number) const {
  const std::vector<LinkedPdo>& pdos = kind == PdoKind::rpdo ? linked_rpdos : linked_tpdos;
  const auto it = std::ranges::lower_bound(
      pdos, number, {}, [](const LinkedPdo& pdo) { return pdo.parameters.number; });
  return it != pdos.end() && it->parameters.number == number ? &*it : nullptr;
}

std::uint16_t Engine::Impl::highest_number(PdoKind kind) const {
  const std::vector<LinkedPdo>& pdos = kind == PdoKind::rpdo ? linked_rpdos : linked_tpdos;
  std::uint16_t highest = pdos.empty() ? std::uint16_t{0} : pdos.back().parameters.number;
  for (std::uint16_t number = kMaxPdo; number > highest; --number) {
    if (dictionary.has_object(static_cast<std::uint16_t>(communication_base(kind) + number - 1))) {
      highest = number;
    }
  }
  return highest;
}

std::optional<Parameters> Engine::Impl::parameters(PdoKind kind, std::uint16_t number) const {
  std::optional<Parameters> read = read_communication(dictionary, kind, number);
  const LinkedPdo* link = linked(kind, number);
  if (!read && link != nullptr) {
    read = link->parameters;
  }
  return read;
}

Engine::Impl::Problem Engine::Impl::compile(PdoKind kind, std::uint16_t number) {
  const auto slot = static_cast<std::uint16_t>(number - 1U);
  stop(kind, slot);
  Problem problem = try_to_compile(kind, number);
  const ReportedProblem present{problem.why, problem.place};
  ReportedProblem& reported = kind == PdoKind::rpdo ? reported_rpdos[slot] : reported_tpdos[slot];
  const bool news = std::exchange(reported, present) != present;
  if (news && problem.why != AbortCode::none && listener != nullptr) {
    listener->pdo_unusable(problem.place, problem.why);
  }
  return problem;
}

Engine::Impl::Problem Engine::Impl::try_to_compile(PdoKind kind, std::uint16_t number) {
  const std::optional<Parameters> pdo = parameters(kind, number);
  if (!pdo || !pdo->cob_id.valid()) {
    return {};
  }
  const auto record = static_cast<std::uint16_t>(communication_base(kind) + number - 1);
  if (const AbortCode why = check_transmission_type(kind, pdo->type, 8 * max_bytes);
      why != AbortCode::none) {
    return {why, {record, 2}, "transmission type " + std::to_string(pdo->type) + " is not for it"};
  }
  const LinkedPdo* const link = linked(kind, number);
  const bool is_srdo = link != nullptr && link->is_srdo();  // these have restricted identifiers
  if (!is_srdo && !pdo->cob_id.extended() && can::is_restricted(pdo->cob_id.id())) {
    return {AbortCode::invalid_value,
            {record, 1},
            "its COB-ID " + hex_of_four(pdo->cob_id.id()) + " is reserved"};
  }
  const MpdoMode mpdo = read_mpdo_mode(dictionary, kind, number);
  CopyPlan plan;
  Problem problem =
      mpdo == MpdoMode::none ? compile_plan(kind, number, plan) : compile_mpdo(kind, *pdo, plan);
  if (problem.why != AbortCode::none || plan.bits == 0) {
    return problem;
  }
  if (kind == PdoKind::rpdo) {
    start_rpdo(*pdo, std::move(plan));
    details[number - 1U].mpdo = mpdo;
  } else {
    start_tpdo(*pdo, std::move(plan));
    start_mpdo(tpdos[number - 1U], mpdo, number);
  }
  return {};
}

Engine::Impl::Problem Engine::Impl::compile_plan(PdoKind kind, std::uint16_t number,
                                                 CopyPlan& plan) const {
  Problem problem;
  if (const LinkedPdo* link = linked(kind, number); link != nullptr) {
    for (const LinkTarget& target : link->targets) {
      plan.skip(target.frame_bit - plan.bits);
      plan.add_image(target.image_bit, target.bits);
    }
    plan.skip(std::uint32_t{link->mapped_bits} - plan.bits);
  } else {
    problem = map_objects(kind, number, plan);
  }
  if (problem.why == AbortCode::none && plan.bits > 8 * max_bytes) {
    const auto record = static_cast<std::uint16_t>(mapping_base(kind) + number - 1);
    return {AbortCode::pdo_length_exceeded,
            {record, 0},
            "it maps " + std::to_string(plan.bits) + " bits"};
  }
  return problem;
}

// An MPDO has no fixed layout, only a fixed length.
Engine::Impl::Problem Engine::Impl::compile_mpdo(PdoKind kind, const Parameters& parameters,
                                                 CopyPlan& plan) const {
  plan.skip(8 * can::kMaxClassicData);
  const auto record = static_cast<std::uint16_t>(mapping_base(kind) + parameters.number - 1);
  const AbortCode why = check_mpdo(dictionary, kind, parameters.number);
  if (why != AbortCode::none) {
    return {why, {record, 0}, "it cannot be multiplexed so: " + std::string(describe(why))};
  }
  return {};
}

// Reserves space for all objects of the list, so that a change never finds the queue full.
void Engine::Impl::read_scanner_list() {
  scanner_list.read(dictionary);
  scanned_objects = 0;
  scanner_list.for_each([this](od::Address address) {
    scanned_objects += dictionary.find(address).has_value() ? 1U : 0U;
  });
  if (source_tpdo) {
    reserve_mpdos(tpdos[*source_tpdo]);
  }
}

void Engine::Impl::reserve_mpdos(Tpdo& pdo) {
  const std::size_t most =
      pdo.mpdo == MpdoMode::source ? std::max(kMpdosWaiting, scanned_objects) : kMpdosWaiting;
  if (reports_transmission && pdo.mpdo == MpdoMode::source) {
    mpdos_under_way.reserve(most);
  }
  pdo.mpdos.reserve(most);
  pdo.held_mpdos.reserve(most);
}

void Engine::Impl::read_dispatcher_list() {
  dispatcher_list.read(dictionary);
  mpdo_places.reserve(dispatcher_list.size());
}

void Engine::Impl::start_mpdo(Tpdo& pdo, MpdoMode mode, std::uint16_t number) {
  pdo.mpdo = mode;
  if (mode == MpdoMode::none) {
    return;
  }
  pdo.direct = false;
  pdo.plain = false;
  reserve_mpdos(pdo);
  if (mode == MpdoMode::source) {
    source_tpdo = static_cast<std::uint16_t>(number - 1U);
    return;
  }
  const auto record = static_cast<std::uint16_t>(mapping_base(PdoKind::tpdo) + number - 1);
  const std::uint64_t raw = dictionary.number({record, 1}).value_or(0);
  pdo.sent_object = Mapping::from_raw(static_cast<std::uint32_t>(raw)).address;
}

Engine::Impl::Problem Engine::Impl::map_objects(PdoKind kind, std::uint16_t number,
                                                CopyPlan& plan) const {
  od::Address entry{static_cast<std::uint16_t>(mapping_base(kind) + number - 1), 0};
  for (const Mapping& mapping : read_mapping(dictionary, kind, number)) {
    ++entry.sub;
    const AbortCode why = map_object(kind, mapping, plan);
    if (why != AbortCode::none) {
      return {why, entry, describe_refusal(mapping, why)};
    }
  }
  return {};
}

AbortCode Engine::Impl::map_object(PdoKind kind, const Mapping& mapping, CopyPlan& plan) const {
  AbortCode why = check_mapping(dictionary, kind, mapping);
  why = why == AbortCode::none ? check_granularity(mapping, 8 * max_bytes) : why;
  if (why != AbortCode::none) {
    return why;
  }
  if (is_dummy(mapping)) {
    plan.skip(mapping.bits);
    return AbortCode::none;
  }
  const od::Variable variable = *dictionary.find(mapping.address);
  const std::optional<image::Place> place = image.locate(variable.data);
  if (!place) {
    const bool is_word = !variable.elsewhere && od::has_fixed_size(variable.type) &&
                         variable.type != od::DataType::boolean;
    plan.add_object(variable.data, mapping.bits, is_word);
  } else if (place->direction == direction_of(kind)) {
    plan.add_image(place->bit_offset, mapping.bits);
  } else {
    return AbortCode::not_mappable;
  }
  return AbortCode::none;
}

void Engine::Impl::start_rpdo(const Parameters& parameters, CopyPlan plan) {
  const auto slot = static_cast<std::uint16_t>(parameters.number - 1U);
  RpdoDetails& pdo = details[slot];
  pdo.active = true;
  pdo.cob_id = parameters.cob_id;
  pdo.type = parameters.type;
  pdo.deadline = parameters.event_timer;
  pdo.plan = std::move(plan);
  pdo.watched = watched_objects(parameters.number);
  if (!pdo.plan.runs.empty() && pdo.plan.runs.front().frame_byte != 0) {
    pdo.plan.runs.insert(pdo.plan.runs.begin(), Run{});  // Rpdo has the run of the first word
  }
  if (pdo.plan.bytes() > can::kMaxClassicData && pdo.long_shadow == RpdoDetails::kNoShadow) {
    pdo.long_shadow = long_shadows.size();
    long_shadows.emplace_back();
  }
  const LinkedPdo* const link = linked(PdoKind::rpdo, parameters.number);
  if (link == nullptr) {
    inputs->pdo(slot).last = {};  // the new mapping has not been received yet
  }
  pdo.is_srdo = link != nullptr && link->is_srdo();
  if (pdo.is_srdo) {
    return;
  }
  dispatch.add(pdo.cob_id.id(), pdo.cob_id.extended(), can::Service::rpdo, slot);
}

void Engine::Impl::start_tpdo(const Parameters& parameters, CopyPlan plan) {
  const auto slot = static_cast<std::uint16_t>(parameters.number - 1U);
  Tpdo& pdo = tpdos[slot];
  pdo.active = true;
  const LinkedPdo* const link = linked(PdoKind::tpdo, parameters.number);
  pdo.linked = link != nullptr;
  pdo.node = link != nullptr ? link->node : std::uint8_t{0};
  pdo.type = parameters.type;
  pdo.sync_start = parameters.sync_start;
  pdo.cob_id = parameters.cob_id;
  pdo.inhibit = is_event_driven(parameters.type) ? parameters.inhibit : Duration::zero();
  pdo.event_timer = parameters.event_timer;
  pdo.timed = pdo.inhibit > Duration::zero() || has_event_timer(pdo);
  pdo.plan = std::move(plan);
  pdo.runs = pdo.plan.runs.data();
  pdo.run_count = static_cast<std::uint8_t>(pdo.plan.runs.size());
  pdo.objects = pdo.plan.objects.data();
  pdo.object_count = static_cast<std::uint8_t>(pdo.plan.objects.size());
  pdo.frame.id = pdo.cob_id.id();
  pdo.frame.flags = pdo.cob_id.extended() ? can::Frame::kExtended : 0;
  pdo.frame.length = static_cast<std::uint8_t>(pdo.plan.bytes());
  if (max_bytes > can::kMaxClassicData) {
    pdo.frame.length = can::fd_length(pdo.plan.bytes());
    pdo.frame.flags |= can::Frame::kFd | can::Frame::kBitRateSwitch;
  }
  pdo.direct = is_event_driven(pdo.type) && !pdo.linked && !reports_transmission && pdo.is_word() &&
               pdo.plan.runs.empty() && std::ranges::all_of(pdo.plan.objects, &ObjectRun::is_word);
  pdo.plain = pdo.direct && !pdo.timed && own_image != nullptr && !pdo.cob_id.extended();
  if ((pdo.cob_id.raw & can::CobId::kNoRtrBit) == 0) {
    dispatch.add(pdo.cob_id.id(), pdo.cob_id.extended(), can::Service::tpdo_rtr, slot);
  }
}

void Engine::Impl::stop(PdoKind kind, std::uint16_t slot) {
  if (kind == PdoKind::rpdo) {
    const can::CobId cob_id = details[slot].cob_id;
    dispatch.remove(cob_id.id(), cob_id.extended(), can::Service::rpdo, slot);
    const bool refused = details[slot].refused;
    details[slot] = {};
    std::uint32_t& attention = inputs->pdo(slot).attention;
    const bool in_error = refused || (attention & (kTimedOut | kLengthReported)) != 0;
    attention &= image::PdoState::kNotValid;
    if (in_error) {
      report_valid_length(slot);
    }
    shadows.remove(slot);
    asked.clear(slot);
    timers.stop(slot);
  } else {
    renew_revision();
    const can::CobId cob_id = tpdos[slot].cob_id;
    dispatch.remove(cob_id.id(), cob_id.extended(), can::Service::tpdo_rtr, slot);
    tpdos[slot] = {};
    unacknowledged.clear(slot);
    under_way[slot].clear();
    if (source_tpdo == slot) {
      source_tpdo.reset();
      mpdos_under_way.clear();
    }
    timers.stop(event_timer(slot));
  }
}

void Engine::Impl::stop_all() {
  for (std::size_t slot = 0; slot < details.size(); ++slot) {
    stop(PdoKind::rpdo, static_cast<std::uint16_t>(slot));
  }
  for (std::size_t slot = 0; slot < tpdos.size(); ++slot) {
    stop(PdoKind::tpdo, static_cast<std::uint16_t>(slot));
  }
}

void Engine::Impl::hook_records(od::Hook* hook) {
  for (const PdoKind kind : {PdoKind::rpdo, PdoKind::tpdo}) {
    for (const std::uint16_t base : {communication_base(kind), mapping_base(kind)}) {
      for (unsigned i = 0; i < kMaxPdo; ++i) {
        (void)dictionary.set_hook(static_cast<std::uint16_t>(base + i), hook);
      }
    }
  }
  for (std::uint16_t i = 0; i < kMpdoLists; ++i) {
    (void)dictionary.set_hook(static_cast<std::uint16_t>(od::objects::kScannerList + i), hook);
    (void)dictionary.set_hook(static_cast<std::uint16_t>(od::objects::kDispatcherList + i), hook);
  }
}

}  // namespace linegate::pdo
