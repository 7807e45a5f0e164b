// SPDX-License-Identifier: Apache-2.0
// Builds from a LineConfig: the checks, the manager's plans, the links of the PDOs.
#pragma once

#include <vector>

#include "stack/base/diagnostic.h"
#include "stack/can/cob_id.h"
#include "stack/diagnosis/canopen_ia.h"
#include "stack/diagnosis/diagnosis.h"
#include "stack/line/config.h"
#include "stack/manager/plan.h"
#include "stack/nmt/flying_master.h"
#include "stack/pdo/link.h"

namespace linegate::line {

// Returns all errors of the configuration itself; their file is the line's name.
std::vector<Diagnostic> check(const LineConfig& config);

// Precondition: check() found no error. The consumer time is 2.5 producer times unless configured.
std::vector<manager::NodePlan> node_plans(const LineConfig& config);

// The consumer heartbeat time of the node; 0 = its heartbeat is not monitored.
Duration consumer_time(const NodeConfig& node);

// The manager's options for the role of the line.
manager::Options manager_options(const LineConfig& config);

// Precondition: the line has a flying master.
nmt::FlyingMasterTimes flying_master_times(const LineConfig& config);

diagnosis::Options diagnosis_options(const LineConfig& config);
diagnosis::CanopenIaOptions canopen_ia_options(const LineConfig& config);

// The COB-ID of the node's EMCYs: 1014h of its device file, or the value that the configuration
// writes to it.
can::CobId emcy_cob_id(const NodeConfig& node);

// Reads the PDOs of every node's device file and links them. The plan refers to config.nodes, which
// must stay where they are.
Loaded<pdo::LinkPlan> link_plan(const LineConfig& config);
// Sets the inhibit times that the line keeps when it sends the RPDOs of the node.
void set_inhibit_times(const NodeConfig& node, pdo::DevicePdos& pdos);
// Sets the queues of the plan's RPDOs from the configuration.
void set_queues(const LineConfig& config, pdo::LinkPlan& plan);

// Lays out the process data of the line's own devices. Seen from the gateway, inputs are the values
// that the devices receive, outputs the values that they send. Entry::remote_pdo is the number of
// the device's RPDO (inputs) or TPDO (outputs) that maps the object by its file, 0 if there is
// none; Entry::local_pdo counts over the whole line. An object that can be mapped has one entry: an
// input if an RPDO maps it or, if no PDO does, could map it.
Loaded<pdo::LinkPlan> device_plan(const LineConfig& config);

// Checks that groups and defaults name existing entries of the output layout, and that groups are
// disjoint.
std::vector<Diagnostic> check_outputs(const LineConfig& config, const image::Layout& outputs);
// Sets group and initial value of each output. Precondition: check_outputs() found nothing.
void describe_outputs(const LineConfig& config, image::Layout& outputs);

}  // namespace linegate::line
