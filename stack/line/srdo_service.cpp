// SPDX-License-Identifier: Apache-2.0
#include "stack/line/srdo_service.h"

#include "stack/base/byte_order.h"
#include "stack/manager/state.h"
#include "stack/od/objects.h"

namespace linegate::line {

SrdoService::SrdoService(ServiceHost& host, const LineConfig& config, const Parts& parts)
    : Service(host),
      timeout_(config.sdo_timeout),
      sdo_(parts.sdo),
      manager_(parts.manager),
      reception_(parts.dispatch, parts.events, config),
      asked_(reception_.sources().size()) {
  reception_.connect(parts.engine, parts.image, parts.rpdos);
}

SrdoService::~SrdoService() {
  sdo_.disown(*this);
}

void SrdoService::advance(Instant now) {
  reception_.advance(now);
  for (std::size_t i = 0; i < asked_.size(); ++i) {
    const srdo::Source& source = reception_.sources()[i];
    if (!source.signature || !has_booted(source.node)) {
      asked_[i] = false;
    } else if (!asked_[i]) {
      asked_[i] = sdo_.submit({.owner = this,
                               .number = i,
                               .node = source.node,
                               .address = {od::objects::kSrdoSignature, source.number},
                               .timeout = timeout_,
                               .priority = sdo::Priority::background},
                              now);
    }
  }
}

bool SrdoService::has_booted(std::uint8_t node) const {
  const manager::NodeState& state = manager_.node(node);
  return host().manages() && manager_.active() && manager_.concluded(node) &&
         manager::is_booted(state.boot) && state.presence == manager::Presence::present;
}

// A node that does not answer is judged by its SRDOs alone.
void SrdoService::completed(sdo::Completion& completion, Instant now) {
  if (completion.abort == AbortCode::none && completion.data.size() == sizeof(std::uint16_t)) {
    reception_.check_signature(static_cast<std::size_t>(completion.number),
                               load_le<std::uint16_t>(completion.data.data()), now);
  }
}

void SrdoService::end(Refusal /*why*/, Instant /*now*/) {
  sdo_.disown(*this);
  asked_.assign(asked_.size(), false);
}

}  // namespace linegate::line
