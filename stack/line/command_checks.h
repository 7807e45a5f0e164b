// SPDX-License-Identifier: Apache-2.0
// The checks of commands that are the same in every role. Private to stack/line.
#pragma once

#include <cstddef>
#include <variant>
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

// CommandKind::output_write, by hand: does not feed a watchdog or take over a group. wrong_state:
// the watchdog of the output's group has fired, see Outputs::fired_group().
Error check_single_output(const SingleOutput& request, const image::Layout& layout,
                          const Outputs& outputs);
// The data of its refusal: the number of the group whose watchdog has fired (2 bytes,
// little-endian); none if it has not.
ReplyData fired_group_of(std::uint32_t entry, const Outputs& outputs);
// CommandKind::emcy_send of a node in that state.
Error check_emcy(nmt::State state);
Error to_error(emcy::SendResult result);
Error check_nmt(nmt::Command command, std::uint8_t node);

// The value of the object, or the list of the objects, as data.
Error read_object(od::Dictionary& dictionary, const std::variant<od::Address, ObjectRange>& what,
                  ReplyData& data);

}  // namespace linegate::line
