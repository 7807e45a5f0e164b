#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""The tables of services, objects, features, sentences and manuals in the READMEs of stack/ (itself, routing, lss,
manager, line, diagnosis, node, scan), and that of faults in deploy/OPERATING.md: every place and every test that
they name exists, and the test is built. The guide's table of events has each kind with its severity. (words.py
checks that no test is disabled.) A test that is not a GoogleTest is named by its path below tests/. Each row is
compared with its tests: see rows.py."""

import fnmatch
import os
import re

import rows as contents
import tree

TABLE = "stack/README.md"
HEADING = "## Services and objects"
FIRST_CELL = "service or object"
ROUTING = "stack/routing/README.md"
ROUTING_HEADING = "## Each public sentence, and its test"
ROUTING_FIRST_CELL = "sentence"
LSS = "stack/lss/README.md"
LSS_HEADING = "## Each service, and its test"
LSS_FIRST_CELL = "service"
MANAGER = "stack/manager/README.md"
MANAGER_HEADING = "## Each sentence of the start-up, and its test"
MANAGER_FIRST_CELL = "sentence"
MANAGER_FEATURE_HEADINGS = [
    "## Configuration manager and program download",
    "## IXXAT manual, chapters 5 and 6",
    "## emotas manual, 8.14 to 8.19",
]
MANAGER_FEATURE_FIRST_CELL = "feature"
LINE = "stack/line/README.md"
LINE_HEADING = "## Data by object, own objects and generic CAN, and their tests"
LINE_FIRST_CELL = "feature"
DIAGNOSIS = "stack/diagnosis/README.md"
DIAGNOSIS_HEADINGS = ["## IXXAT manual, chapters 7 to 9", "## CANopenIA manual, chapters 5 and 6"]
DIAGNOSIS_FIRST_CELL = "feature"
INDICATIONS = "stack/node/README.md"
INDICATIONS_HEADING = "## The indications of the emotas stack"
INDICATIONS_FIRST_CELL = "indication"
SCAN = "stack/scan/README.md"
SCAN_HEADINGS = ("## IXXAT manual, 5.9 and 8.1.4", "## CANopenIA manual, 6.5")
SCAN_FIRST_CELL = "feature"
FAULTS = "deploy/OPERATING.md"
FAULTS_HEADING = "## When something fails"
FAULTS_FIRST_CELL = "what is seen"
EVENTS_HEADING = "## The log, and what each event says"
EVENTS_FIRST_CELL = "event"
EVENT_KINDS = "stack/base/event.cpp"
EVENT_KIND = re.compile(r'\{"([a-z-]+)", EventSeverity::(\w+)\}')
IN_CODE = re.compile(r"`([^`]*)`")
TEST = re.compile(r"^(?:TYPED_)?TEST(?:_[FP])?\(\s*(\w+)\s*,\s*(\w+)\s*\)", re.MULTILINE)


def tests_of(root):
    """Returns Suite.Name of each test whose file the CMakeLists.txt in its folder names, or has a pattern (GLOB) of."""
    found = set()
    for folder, _, files in tree.walk(root):
        if folder.split(os.sep)[0] != "tests" or "CMakeLists.txt" not in files:
            continue
        built = re.split(r"[\s()]+", tree.read(root, os.path.join(folder, "CMakeLists.txt")))
        patterns = [word for word in built if word.endswith(".cpp")]
        for name in files:
            if any(fnmatch.fnmatch(name, pattern) for pattern in patterns):
                text = tree.read(root, os.path.join(folder, name))
                found.update(f"{test[1]}.{test[2]}" for test in TEST.finditer(text))
    return found


def rows(root, table, heading, first_cell):
    """Returns (line number, cells) of each row below the heading, up to the next heading."""
    inside = False
    for number, line in tree.lines(root, table):
        inside = line == heading if line.startswith("## ") else inside
        if inside and line.startswith("|") and set(line) - set("|- "):
            cells = [cell.strip() for cell in line.strip("|").split("|")]
            if cells[0] != first_cell:
                yield number, cells


def wrong_tests(root, cell, tests):
    names = IN_CODE.findall(cell)
    if not names:
        yield "names no test"
    for name in names:
        exists = os.path.exists(os.path.join(root, "tests", name)) if "/" in name else name in tests
        if not exists:
            yield f"there is no test {name}"


def wrong_in(root, cells, tests, known=None):
    if len(cells) != 3:
        yield "a row has three cells: service or object, where, test"
        return
    places = IN_CODE.findall(cells[1])
    if not places:
        yield "names no place"
    for place in places:
        if not any(os.path.exists(os.path.join(root, base, place)) for base in ("stack", "")):
            yield f"there is no {place}"
    wrong = list(wrong_tests(root, cells[2], tests))
    yield from wrong
    if known is not None and not wrong:
        yield from contents.unsaid(cells[0], IN_CODE.findall(cells[2]), *known)


def wrong_in_fault(root, cells, tests):
    if len(cells) != 4 or not all(cells):
        yield "a row has four cells: what is seen, what happens, what to do, shown by"
        return
    yield from wrong_tests(root, cells[3], tests)


def check_table(root, tests, table, heading, first_cell, wrong):
    found = list(rows(root, table, heading, first_cell)) if os.path.exists(os.path.join(root, table)) else []
    if not found:
        yield f"{table}: no rows below '{heading}'"
    for number, cells in found:
        for complaint in wrong(root, cells, tests):
            yield f"{table}:{number}: {complaint}"


def event_kinds(root):
    """Returns the severity of each kind of event."""
    if not os.path.exists(os.path.join(root, EVENT_KINDS)):
        return {}
    return dict(EVENT_KIND.findall(tree.read(root, EVENT_KINDS)))


def check_events(root):
    if not os.path.exists(os.path.join(root, EVENT_KINDS)):
        return
    kinds = {f"`{name}`": severity for name, severity in event_kinds(root).items()}
    told = {}
    for number, cells in rows(root, FAULTS, EVENTS_HEADING, EVENTS_FIRST_CELL):
        told[cells[0]] = cells[1]
        if kinds.get(cells[0]) != cells[1]:
            yield f"{FAULTS}:{number}: {EVENT_KINDS} has no {cells[0]} of severity {cells[1]}"
    for kind in kinds.keys() - told.keys():
        yield f"{FAULTS}: no row for the event {kind} below '{EVENTS_HEADING}'"


def check(root):
    if not os.path.exists(os.path.join(root, "stack")):
        return
    tests = tests_of(root)
    known = contents.Tests(root), event_kinds(root)

    def wrong(root, cells, tests):
        return wrong_in(root, cells, tests, known)

    yield from check_table(root, tests, TABLE, HEADING, FIRST_CELL, wrong)
    if os.path.exists(os.path.join(root, "stack/routing")):
        yield from check_table(root, tests, ROUTING, ROUTING_HEADING, ROUTING_FIRST_CELL, wrong)
    if os.path.exists(os.path.join(root, "stack/lss")):
        yield from check_table(root, tests, LSS, LSS_HEADING, LSS_FIRST_CELL, wrong)
    if os.path.exists(os.path.join(root, "stack/manager")):
        yield from check_table(root, tests, MANAGER, MANAGER_HEADING, MANAGER_FIRST_CELL, wrong)
        for heading in MANAGER_FEATURE_HEADINGS:
            yield from check_table(root, tests, MANAGER, heading, MANAGER_FEATURE_FIRST_CELL, wrong)
    if os.path.exists(os.path.join(root, "stack/line")):
        yield from check_table(root, tests, LINE, LINE_HEADING, LINE_FIRST_CELL, wrong)
    if os.path.exists(os.path.join(root, "stack/diagnosis")):
        for heading in DIAGNOSIS_HEADINGS:
            yield from check_table(root, tests, DIAGNOSIS, heading, DIAGNOSIS_FIRST_CELL, wrong)
    if os.path.exists(os.path.join(root, "stack/node")):
        yield from check_table(root, tests, INDICATIONS, INDICATIONS_HEADING, INDICATIONS_FIRST_CELL, wrong)
    if os.path.exists(os.path.join(root, "stack/scan")):
        for heading in SCAN_HEADINGS:
            yield from check_table(root, tests, SCAN, heading, SCAN_FIRST_CELL, wrong)
    yield from check_table(root, tests, FAULTS, FAULTS_HEADING, FAULTS_FIRST_CELL, wrong_in_fault)
    yield from check_events(root)


if __name__ == "__main__":
    tree.run(check)
