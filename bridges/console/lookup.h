// SPDX-License-Identifier: Apache-2.0
// Finding what a command is about: waits until it has been heard of.
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

// Letters, digits, '-' and '_', as plant.yaml allows for gateways, lines and nodes. What comes from
// the network may have other names.
bool is_plain_name(const std::string& text);

std::optional<NodeRef> parse_node(const std::string& text);
// Looks up the node's name among the nodes of the line, and sets ref.node; otherwise says on
// context.err which names there are. True also if it has no name.
bool resolve_node(Context& context, Model& model, const Line& line, NodeRef& ref);
// "LINE", which is all of its nodes, or "LINE:NODE" with a node-ID or all (node is 0 then);
// otherwise says on context.err that it is none of them.
std::optional<NodeRef> line_or_node(Context& context, const std::string& what);
// As it was typed, index and sub-index or both in `index`; otherwise says on context.err that it is
// no object. sub empty: that of `index`, or 0.
std::optional<od::Address> parse_object(Context& context, const std::string& index,
                                        const std::string& sub);
// INDEX:SUB, INDEX SUB or INDEX, and the words behind.
struct ObjectWords {
  std::string index;
  std::string sub;
  std::vector<std::string> rest;
};
// From the words of a command line, with `least` to `most` words behind the object. Nothing: too
// few or too many words. Where both readings have a meaning ("6000 d"), a sub-index is read.
std::optional<ObjectWords> split_object(const std::vector<std::string>& words, std::size_t least,
                                        std::size_t most);
// Of INDEX WORD VALUE: why the word is not read, if it is a sub-index and a data type ("1021 d
// 00FF", "2005 b 1"). Empty: it is one of them at most.
std::string why_ambiguous(const std::vector<std::string>& words);
// Decimal or 0x; `hex`: hexadecimal without 0x too. Nothing beyond `limit`.
std::optional<std::uint64_t> parse_number(const std::string& text, std::uint64_t limit, bool hex);

// The output entry by its name, by NODE.INDEX:SUB (node: name or node-ID), or by its number in the
// layout; otherwise says on context.err which names there are, or which are meant.
std::optional<std::uint32_t> find_entry(Context& context, const image::Layout& layout,
                                        const std::string& entry);

}  // namespace linegate::console
