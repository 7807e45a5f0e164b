// SPDX-License-Identifier: Apache-2.0
// The checks of commands that are the same in every role. Private to stack/line.
#pragma once

#include <cstddef>
#include <vector>

#include "stack/base/result.h"
#include "stack/emcy/producer.h"
#include "stack/image/layout.h"
#include "stack/line/command.h"
#include "stack/line/outputs.h"
#include "stack/nmt/state.h"
#include "stack/od/dictionary.h"

namespace linegate::line {

// Each returns the reason to reject the command; Domain::none if there is none.

// CommandKind::output_write, by hand: does not feed a watchdog or take over a group.
Error check_single_output(const Command& command, const image::Layout& layout,
                          const Outputs& outputs);
// CommandKind::emcy_send of a node in that state.
Error check_emcy(const Command& command, nmt::State state);
Error to_error(emcy::SendResult result);
Error check_nmt(nmt::Command command, std::uint8_t node);

// CommandKind::local_read with kListObjects: the last index of the list.
std::uint16_t last_of_list(const Command& command);
// CommandKind::local_read and other reads of an object of a dictionary.
Error read_object(od::Dictionary& dictionary, const Command& command, std::vector<std::byte>& data);

}  // namespace linegate::line
