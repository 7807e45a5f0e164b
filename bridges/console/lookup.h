// SPDX-License-Identifier: Apache-2.0
// Finds the target of a command, and waits until it was received.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "bridges/console/commands.h"
#include "stack/od/description.h"

namespace linegate::console {

// The clock of Model::at(), and the wall clock.
Instant steady_now();
Instant utc_now();

// Passes received samples to the model; reports dropped ones on context.err, each kind once.
void poll(Context& context, Model& model, Duration timeout);

// Polls until the condition holds or context.wait has passed. Returns whether it holds.
bool wait_until(Context& context, Model& model, const std::function<bool()>& condition);

// Polls until the condition holds, for samples of a gateway of which another one was received: not
// longer than all of them take, nor than context.wait. Returns whether it holds.
bool wait_for_samples(Context& context, Model& model, const std::function<bool()>& condition);

// Polls until all gateways are received (discovery.h) and the condition holds. Returns false if
// context.wait passes before.
bool wait_until_settled(Context& context, Model& model, const std::function<bool()>& condition);

// Whether the gateway of the line has removed it: its list of lines does not have it, and only old
// events of it were received.
bool is_removed(const Model& model, const Line& line);

// Returns kDone, or kIncomplete after a message on context.err that names what is missing.
int completeness(Context& context, const Model& model);

// The error message of a command that received nothing from any gateway: where the client looked,
// and what to check.
std::string no_gateway_text(const Context& context);
// That no line has this name (empty: that there is no line), with the lines found and what was not
// received; or no_gateway_text(). also: what there is not, either: " and no route to network 7".
std::string no_line_text(const Context& context, const Model& model, const std::string& name,
                         const std::string& also = "");

// The only line with that name; nullptr after an error message that lists the candidates.
// "GATEWAY/LINE" is unambiguous as soon as it is received, and refused once that gateway had all of
// its lines received for context.quiet, and this one is not among them. Other names wait for all
// gateways.
const Line* find_line(Context& context, Model& model, const std::string& line);

// The same in steps, for names that may be something other than a line.
enum class Lookup {
  found,      // the condition holds
  absent,     // the gateway in "GATEWAY/LINE" has nothing of that name
  timed_out,  // context.wait has passed
};
// Waits for the condition, as find_line() does for a line. The condition of a name without a
// gateway holds once all gateways are received.
Lookup look_up(Context& context, Model& model, const std::string& name,
               const std::function<bool()>& condition);
// Whether a line has that name, and all that have it are received.
bool is_received(const Model& model, const std::string& name);
// The line of that name; nullptr after an error message.
const Line* looked_up(Context& context, const Model& model, const std::string& name, Lookup result);
// The error message of Lookup::absent, with the lines of the gateway. also: as no_line_text().
std::string absent_text(const Model& model, const std::string& name, const std::string& also = "");

// Whether the states of all configured nodes of the line were received. Precondition: line.view is
// set.
bool knows_nodes(const Line& line);
// Waits for the states of all configured nodes; false if context.wait passes before. Precondition:
// line.view is set.
bool know_nodes(Context& context, Model& model, const Line& line);

// Letters, digits, '-' and '_', as plant.yaml permits for gateways, lines and nodes. Names from the
// network may have other characters.
bool is_plain_name(const std::string& text);

std::optional<NodeRef> parse_node(const std::string& text);
// Looks up the node's name on the line and sets ref.node; returns false after an error message that
// lists the names. True also if there is no name to look up.
bool resolve_node(Context& context, Model& model, const Line& line, NodeRef& ref);
// The error message of a node that a line does not have, with the names of those that it has.
void report_no_node(Context& context, const Line& line, const std::string& node);
// "LINE" (all of its nodes), or "LINE:NODE" with a node-ID or `all` (node is then 0), and with
// `own` where that is permitted. Nothing, after an error message, for other texts.
enum class OwnNode { refused, permitted };
std::optional<NodeRef> line_or_node(Context& context, const std::string& what,
                                    OwnNode own = OwnNode::refused);
// index has the index, or index and sub-index; an empty sub selects the sub-index in `index`, or 0.
// Nothing, after an error message, if it is not an object.
std::optional<od::Address> parse_object(Context& context, const std::string& index,
                                        const std::string& sub);
// INDEX:SUB, INDEX SUB or INDEX, and the words that follow.
struct ObjectWords {
  std::string index;
  std::string sub;
  std::vector<std::string> rest;
};
// Splits the words of a command line, with `least` to `most` words after the object. Returns
// nothing for another number of words. If both readings are possible ("6000 d"), the word is a
// sub-index.
std::optional<ObjectWords> split_object(const std::vector<std::string>& words, std::size_t least,
                                        std::size_t most);
// For INDEX WORD VALUE: an error message if WORD can be a sub-index and a data type ("1021 d 00FF",
// "2005 b 1"). Empty if it is unambiguous.
std::string why_ambiguous(const std::vector<std::string>& words);
// Decimal or 0x; `hex`: hexadecimal without 0x too. Nothing if greater than `limit`.
std::optional<std::uint64_t> parse_number(const std::string& text, std::uint64_t limit, bool hex);

// Finds the output entry by its name, by NODE.INDEX:SUB (node: name or node-ID), or by its number
// in the layout. Otherwise lists the names or the candidates on context.err.
std::optional<std::uint32_t> find_entry(Context& context, const image::Layout& layout,
                                        const std::string& entry);

}  // namespace linegate::console
