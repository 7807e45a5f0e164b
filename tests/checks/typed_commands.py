#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Each command of the contract has a typed form in each language of the client library, the same ones in all of them,
and those in C have their symbol version. The comment (in Python the docstring) of the typed form names its CommandKind.
Those in Python call those in C, so that one library encodes requests, and each number of those in C has a test of its
range."""

import os
import re

import kinds
import tree

BYTES = "idl/COMMANDS.md"
CPP, CPP_LINE = "bridges/client/commands.h", "bridges/client/client.h"
IN_C, SYMBOLS = "bridges/client/linegate.h", "gateway/client/exported_symbols"
PYTHON, PYTHON_LINE = "bridges/client/python/linegate/commands.py", "bridges/client/python/linegate/__init__.py"
OF_LINE = {"sdo_read", "sdo_write", "nmt"}  # of the class Line
NOT_TYPED = {"request_call"}
RANGES = "tests/bridges/client/parameters_test.cpp"
NUMBER = re.compile(r"\b(?:unsigned|uint32_t) (\w+)")
OF_32_BITS = {"flags", "highest_revision", "highest_serial"}  # and the number of a connection
OTHER_NAMES = {"delay_ms": "delay", "client_node": "client", "server_node": "server"}  # in messages, as in C++
CPP_METHOD = re.compile(r"^  (?:Answer<.*>|Call) (\w+)\(", re.MULTILINE)
# In C a command has a line and, last, a time-out.
C_FUNCTION = re.compile(r"^int linegate_(\w+)\(linegate_client\* client, int line,[^;]*\bint timeout_ms\);", re.MULTILINE)
C_VERSIONED = re.compile(r"^int (linegate_\w+)\(", re.MULTILINE)
C_LATER = "/* ---- typed commands ---- */"  # from there on: LINEGATE_2
PYTHON_METHOD = re.compile(r'^    def ([a-z]\w*)\(.*?\).*?:\n        """(.*?)"""', re.MULTILINE | re.DOTALL)
LSS_CODE = re.compile(r"^\| \d+ \|", re.MULTILINE)
LSS_SECTION = re.compile(r"^## COMMAND_LSS$.*?(?=^## |\Z)", re.MULTILINE | re.DOTALL)
HEADING = re.compile(r"^## (COMMAND_.*)$", re.MULTILINE)


def body(text, head):
    """Returns the text of a class of C++ or Python, without those behind it."""
    found = re.search(rf"^class {head}\b.*?(?=^\}};|^class |^@|\Z)", text, re.MULTILINE | re.DOTALL)
    return found[0] if found else ""


def of_cpp(root):
    line = {name for name in CPP_METHOD.findall(body(tree.read(root, CPP_LINE), "Line")) if name in OF_LINE}
    public = body(tree.read(root, CPP), "Commands").split(" private:")[0]
    return line | set(CPP_METHOD.findall(public))


def of_c(root):
    return {name for name in C_FUNCTION.findall(tree.read(root, IN_C)) if name not in {*NOT_TYPED, "line_wait"}}


def docstrings(root):
    """Returns the docstring of each typed form in Python."""
    line = dict(PYTHON_METHOD.findall(body(tree.read(root, PYTHON_LINE), "Line")))
    own = dict(PYTHON_METHOD.findall(body(tree.read(root, PYTHON), "Commands")))
    return {**{name: text for name, text in line.items() if name in OF_LINE}, **own}


def untested_numbers(root):
    """A row of the test begins with the command and its parameter."""
    rows = set(re.findall(r'\{\s*"(\w+)",\s*"(\w+)",', tree.read(root, RANGES)))
    for found in C_FUNCTION.finditer(tree.read(root, IN_C)):
        for number in NUMBER.findall(found[0]):
            row = found[1], OTHER_NAMES.get(number, number)
            if number not in OF_32_BITS and row != ("close_connection", "number") and row not in rows:
                yield f"{RANGES}: no row for {number} of linegate_{found[1]}"


def encoded_in_python(root):
    """A typed form calls the function of linegate.h, before the next one begins."""
    methods = re.split(r"^    def (\w+)\(", body(tree.read(root, PYTHON), "Commands") +
                       body(tree.read(root, PYTHON_LINE), "Line"), flags=re.MULTILINE)
    for name, text in zip(methods[1::2], methods[2::2]):
        if name in of_c(root) and f"_lib.linegate_{name}," not in text:
            yield f"{PYTHON}: {name} does not call linegate_{name}"


def unversioned(root):
    later = tree.read(root, IN_C).partition(C_LATER)[2]
    node = re.search(r"^LINEGATE_2 \{(.*?)^\}", tree.read(root, SYMBOLS), re.MULTILINE | re.DOTALL)
    symbols = set(re.findall(r"\w+", node[1])) if node else set()
    for name in C_VERSIONED.findall(later):
        if name not in symbols:
            yield f"{SYMBOLS}: {name} of {IN_C} is not in LINEGATE_2"


def check(root):
    if not os.path.exists(os.path.join(root, CPP)):
        return
    documented = docstrings(root)
    forms = {CPP: of_cpp(root), IN_C: of_c(root), PYTHON: set(documented)}
    for name in sorted(set.union(*forms.values())):
        for path, names in forms.items():
            if name not in names:
                yield f"{path}: the typed command {name} is missing"
    of_contract = [name.upper() for name in kinds.contract(root, "CommandKind", "COMMAND_").values()]
    texts = {CPP: tree.read(root, CPP) + tree.read(root, CPP_LINE), IN_C: tree.read(root, IN_C),
             PYTHON: "\n".join(f"COMMAND_{text}" for text in documented.values())}
    for kind in of_contract:
        for path, text in texts.items():
            if not re.search(rf"\bCOMMAND_{kind}\b", text):
                yield f"{path}: no typed command names COMMAND_{kind}"
    contents = tree.read(root, BYTES)
    for heading in HEADING.findall(contents):
        for kind in re.findall(r"COMMAND_(\w+)", heading):
            if kind not in of_contract:
                yield f"{BYTES}: {kinds.CONTRACT} has no COMMAND_{kind}"
    section = LSS_SECTION.search(contents)
    services = len(LSS_CODE.findall(section[0])) if section else 0
    if services != sum(name.startswith("lss_") for name in forms[CPP]):
        yield f"{CPP}: {BYTES} has {services} codes of COMMAND_LSS, and the typed commands are not as many"
    yield from unversioned(root)
    yield from untested_numbers(root)
    yield from encoded_in_python(root)


if __name__ == "__main__":
    tree.run(check)
