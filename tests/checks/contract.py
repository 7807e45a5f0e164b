#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Version 1 of the DDS contract does not change: every declaration of contract_v1.txt is in idl/linegate.idl with the same
text. An enumeration may have more members at its end; other declarations may be new.

`contract.py --record` adds new declarations and members to contract_v1.txt, for a release. It never changes what is there."""

import os
import re
import sys

import tree

CONTRACT = "idl/linegate.idl"
FROZEN = "tests/checks/contract_v1.txt"
HEAD = """\
# SPDX-License-Identifier: Apache-2.0
# What never changes in version 1 of idl/linegate.idl: one declaration a line, without comments. contract.py reads and writes it.
"""
DECLARATION = re.compile(r"(const [\w ]+? (?P<constant>\w+) = [^;]+"
                         r"|enum (?P<enumeration>\w+) \{[^{}]*\}"
                         r"|(?:@\w+ )*struct (?P<structure>\w+) \{[^{}]*\});")


def declarations(text):
    """Returns the declarations of an IDL file by their name, in their order, and what else is in it."""
    code = " ".join(re.sub(r"//[^\n]*", "", text).split())
    found = {}
    for match in DECLARATION.finditer(code):
        found[match["constant"] or match["enumeration"] or match["structure"]] = match[1]
    rest = re.sub(r"\s+", " ", DECLARATION.sub("", code)).strip()
    return found, rest


def frozen(root):
    """Returns the declarations of contract_v1.txt by their name."""
    code = "".join(line + "\n" for _, line in tree.lines(root, FROZEN) if not line.startswith("#"))
    return declarations(code)[0]


def members(declaration):
    """Returns the members of an enumeration; None for another declaration."""
    body = re.match(r"enum \w+ \{([^{}]*)\}", declaration)
    return [name.strip() for name in body[1].split(",")] if body else None


def extends(now, before):
    """True if a declaration is the one before, or an enumeration with more members at its end."""
    old, new = members(before), members(now)
    return now == before or (old is not None and new is not None and new[:len(old)] == old)


def check(root):
    now, rest = declarations(tree.read(root, CONTRACT))
    if rest != "module linegate { module v1 { }; };":
        yield f"{CONTRACT}: something that is neither a constant, an enumeration nor a struct of linegate::v1: {rest[:120]}"
    for name, before in frozen(root).items():
        if name not in now:
            yield f"{CONTRACT}: {name} of version 1 is missing"
        elif not extends(now[name], before):
            yield f"{CONTRACT}: {name} is not that of version 1, which {FROZEN} has: {now[name][:200]}"


def record(root):
    """Adds what is new, in the order of the contract; a declaration that was removed or changed is a complaint of check()."""
    now, _ = declarations(tree.read(root, CONTRACT))
    with open(os.path.join(root, FROZEN), "w", encoding="utf-8") as file:
        file.write(HEAD + "".join(f"{declaration};\n" for declaration in now.values()))


def main():
    if sys.argv[1:2] != ["--record"]:
        tree.run(check)
    root = os.path.realpath(os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", ".."))
    complaints = list(check(root))
    if complaints:
        sys.exit("\n".join(complaints))
    record(root)


if __name__ == "__main__":
    main()
