// SPDX-License-Identifier: Apache-2.0
// From LineConfig to what runs: the checks, the manager's plans, the links of the PDOs.
#pragma once

#include <vector>

#include "stack/base/diagnostic.h"
#include "stack/can/cob_id.h"
#include "stack/diagnosis/canopen_ia.h"
#include "stack/diagnosis/diagnosis.h"
#include "stack/line/config.h"
#include "stack/manager/plan.h"
#include "stack/pdo/link.h"

namespace linegate::line {

// Everything wrong with the configuration itself; file is the line's name.
std::vector<Diagnostic> check(const LineConfig& config);

// Precondition: check() found no error. The consumer time is 2.5 producer times unless configured.
std::vector<manager::NodePlan> node_plans(const LineConfig& config);

// Without a heartbeat of the node for so long it is lost; 0 = its heartbeat is not monitored.
Duration consumer_time(const NodeConfig& node);

// What the manager does by itself, in the line's role.
manager::Options manager_options(const LineConfig& config);

diagnosis::Options diagnosis_options(const LineConfig& config);
diagnosis::CanopenIaOptions canopen_ia_options(const LineConfig& config);

// On which the node sends its EMCYs: 1014h as its file says, or as it is written after that.
can::CobId emcy_cob_id(const NodeConfig& node);

// Reads the PDOs of every node's device file and links them. The nodes must stay where they are.
Loaded<pdo::LinkPlan> link_plan(const LineConfig& config);
// Gives its RPDOs the queues of the configuration.
void set_queues(const LineConfig& config, pdo::LinkPlan& plan);

// Where the process data of the line's own devices lie. Seen from the gateway: inputs are what the
// devices receive, outputs what they send; Entry::remote_pdo is the number of the device's RPDO
// (inputs) or TPDO (outputs) that maps the object by its file, 0 if none does, Entry::local_pdo
// counts all of the line. An object that can be mapped has one entry: an input if an RPDO maps it
// or, when no PDO does, could.
Loaded<pdo::LinkPlan> device_plan(const LineConfig& config);

// Groups and defaults name entries of the output layout that exist, and groups are disjoint.
std::vector<Diagnostic> check_outputs(const LineConfig& config, const image::Layout& outputs);

}  // namespace linegate::line
