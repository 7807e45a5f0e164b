#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Each kind of command and of event has the same number in the DDS contract, which numbers its members by their order,
and in the program. The build finds a difference too, but only after it has compiled everything that includes the
contract."""

import os
import re

import tree

CONTRACT = "idl/linegate.idl"
COMMANDS = "stack/line/requests.h"
EVENTS = "stack/base/events.h"
GATEWAY = os.path.join("bridges", "request")
# The number and the name of a request that the gateway executes.
OF_GATEWAY = re.compile(r'kKind\{(\d+)\};\s*static constexpr std::string_view kName = "([\w-]+)";')


def members(text, head):
    """Returns (name, explicit number or None) of each member of the enumeration that begins with head."""
    body = re.search(rf"{head}\s*\{{(.*?)\}};", text, re.DOTALL)
    code = re.sub(r"//[^\n]*", "", body[1]) if body else ""
    found = re.findall(r"(\w+)(?:\s*=\s*(\d+))?\s*(?:,|$)", code)
    return [(name, int(number) if number else None) for name, number in found]


def numbered(found):
    """Returns the names by number. A member without a number follows the previous one."""
    out = {}
    following = 0
    for name, number in found:
        following = following if number is None else number
        out[following] = name
        following += 1
    return out


def contract(root, head, prefix):
    found = numbered(members(tree.read(root, CONTRACT), rf"enum {head}"))
    return {number: name.removeprefix(prefix).lower() for number, name in found.items()}


def of_gateway(root):
    for path in tree.files(root, (".h",)):
        if os.path.dirname(path) == GATEWAY:
            for number, name in OF_GATEWAY.findall(tree.read(root, path)):
                yield path, int(number), name.replace("-", "_")


def of_stack(root, path, enumeration):
    found = numbered(members(tree.read(root, path), rf"enum class {enumeration} : [\w:]+"))
    return [(path, number, name) for number, name in found.items()]


def compare(prefix, wanted, found, where):
    """wanted: names of the contract by number. found: (file, number, name) of the program. where: its files."""
    right = {name: number for number, name in wanted.items()}
    for path, number, name in found:
        if name not in right:
            yield f"{path}: {name} has the number {number}, {CONTRACT} has no {prefix}{name.upper()}"
        elif right[name] != number:
            yield f"{path}: {name} has the number {number}, {prefix}{name.upper()} in {CONTRACT} has {right[name]}"
    names = {name for _, _, name in found}
    for number, name in wanted.items():
        if name not in names:
            yield f"{CONTRACT}: {prefix}{name.upper()} has the number {number}, and is missing in {where}"


def check(root):
    commands = [*of_stack(root, COMMANDS, "CommandKind"), *of_gateway(root)]
    yield from compare("COMMAND_", contract(root, "CommandKind", "COMMAND_"), commands, f"{COMMANDS} and {GATEWAY}")
    yield from compare("EVENT_", contract(root, "EventKind", "EVENT_"), of_stack(root, EVENTS, "EventKind"), EVENTS)


if __name__ == "__main__":
    tree.run(check)
