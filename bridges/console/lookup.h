// Finding what a command is about: waits until it has been heard of.
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "bridges/console/commands.h"

namespace linegate::console {

// The clock of Model::at(), and the wall clock.
Instant steady_now();
Instant utc_now();

// What arrives goes to the model; what was dropped is said on context.err, each kind once.
void poll(Context& context, Model& model, Duration timeout);

// Polls until condition() or context.wait has passed.
bool wait_until(Context& context, Model& model, const std::function<bool()>& condition);

// Polls until all gateways are received (discovery.h) and the condition holds. False: context.wait
// has passed before.
bool wait_until_settled(Context& context, Model& model, const std::function<bool()>& condition);

// kDone, or kIncomplete after a message on context.err that says what is missing in what was
// printed.
int completeness(Context& context, const Model& model);

// The one line that is meant; otherwise says on context.err what there is instead. "GATEWAY/LINE"
// is unambiguous as soon as it is received. Any other name waits for all gateways.
const Line* find_line(Context& context, Model& model, const std::string& line);

// Whether the states of all nodes that the line is configured with are received. line.view is
// there.
bool knows_nodes(const Line& line);
// Waits until the line has told of all nodes that it is configured with, of others or not; false
// if context.wait was not enough. line.view is there.
bool know_nodes(Context& context, Model& model, const Line& line);

std::optional<NodeRef> parse_node(const std::string& text);
// "LINE", which is all of its nodes, or "LINE:NODE" with a node-ID or all (node is 0 then);
// otherwise says on context.err that it is none of them.
std::optional<NodeRef> line_or_node(Context& context, const std::string& what);
// Decimal or 0x; `hex`: hexadecimal without 0x too. Nothing beyond `limit`.
std::optional<std::uint64_t> parse_number(const std::string& text, std::uint64_t limit, bool hex);

// The output entry; otherwise says on context.err which names there are.
std::optional<std::uint32_t> find_entry(Context& context, const image::Layout& layout,
                                        const std::string& entry);

}  // namespace linegate::console
