// SPDX-License-Identifier: Apache-2.0
// The SRDOs (EN 50325-5) of a line by its configuration: those that its nodes transmit are inputs.
#pragma once

#include <vector>

#include "stack/base/diagnostic.h"
#include "stack/line/config.h"
#include "stack/manager/assumed_pdo.h"
#include "stack/pdo/parameters.h"
#include "stack/srdo/consumer.h"

namespace linegate::line {

// Those that the node transmits by its device file, as the PDOs of RemoteNode::srdos. Errors in
// them are reported by check_srdos().
std::vector<pdo::Parameters> transmitted_srdos(const NodeConfig& node);

// What is to be received, in the order of nodes and numbers. The SCT is that of
// NodeConfig::srdo_cycle, else twice the refresh time of the node; the SRVT that of
// NodeConfig::srdo_validation, else the one in the node.
std::vector<srdo::Source> srdo_sources(const LineConfig& config);

// The parameters that the image relies on, of each of these SRDOs: direction, COB-IDs and mapping.
std::vector<std::vector<manager::ObjectWrite>> srdo_parameters(const LineConfig& config);
// Those of the node that its boot process compares with the device: SRDOs that are configured, or
// have no signature in 13FFh, which SrdoService compares, because a node need not stay unstarted
// for an SRDO that is only shown. Nothing is corrected: a write would invalidate its safety
// configuration.
std::vector<manager::AssumedPdo> assumed_srdos(const NodeConfig& node);

// Switches off the SRDOs that have the COB-IDs of another node's and are not configured, with
// warnings: constants of one device file are no identifiers of several nodes. Without this, and for
// those that are configured, plan_links() reports errors.
std::vector<Diagnostic> leave_out_srdos(LineConfig& config);

// Errors and warnings of describe_srdo(), and a warning for each SRDO that a node receives and no
// node of the line transmits: Linegate produces no SRDOs.
std::vector<Diagnostic> check_srdos(const LineConfig& config);

// The number of the SRDO that the node receives with this object, because of which it is no output;
// 0 if there is none.
std::uint8_t received_srdo(const NodeConfig& node, od::Address address);

}  // namespace linegate::line
