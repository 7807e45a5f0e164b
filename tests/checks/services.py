#!/usr/bin/python3
"""The table of services and objects in stack/README.md: every place and every test it names exists, and the test is
built. (That none is switched off is what words.py looks after.) What is no test of GoogleTest is named by its path
below tests/."""

import os
import re

import tree

TABLE = "stack/README.md"
HEADING = "## Services and objects"
FIRST_CELL = "service or object"
IN_CODE = re.compile(r"`([^`]*)`")
TEST = re.compile(r"^(?:TYPED_)?TEST(?:_[FP])?\(\s*(\w+)\s*,\s*(\w+)\s*\)", re.MULTILINE)


def tests_of(root):
    """Suite.Name of each test whose file is named by the CMakeLists.txt beside it."""
    found = set()
    for folder, _, files in tree.walk(root):
        if folder.split(os.sep)[0] != "tests" or "CMakeLists.txt" not in files:
            continue
        built = re.split(r"[\s()]+", tree.read(root, os.path.join(folder, "CMakeLists.txt")))
        for name in set(built).intersection(files):
            if name.endswith(".cpp"):
                text = tree.read(root, os.path.join(folder, name))
                found.update(f"{test[1]}.{test[2]}" for test in TEST.finditer(text))
    return found


def rows(root):
    """(line number, cells) of each row below the heading."""
    inside = False
    for number, line in tree.lines(root, TABLE):
        inside = inside or line == HEADING
        if inside and line.startswith("|") and set(line) - set("|- "):
            cells = [cell.strip() for cell in line.strip("|").split("|")]
            if cells[0] != FIRST_CELL:
                yield number, cells


def wrong_in(root, cells, tests):
    if len(cells) != 3:
        yield "a row has three cells: service or object, where, test"
        return
    places, names = IN_CODE.findall(cells[1]), IN_CODE.findall(cells[2])
    if not places or not names:
        yield "names no place or no test"
    for place in places:
        if not any(os.path.exists(os.path.join(root, base, place)) for base in ("stack", "")):
            yield f"there is no {place}"
    for name in names:
        exists = os.path.exists(os.path.join(root, "tests", name)) if "/" in name else name in tests
        if not exists:
            yield f"there is no test {name}"


def check(root):
    if not os.path.exists(os.path.join(root, "stack")):
        return
    tests = tests_of(root)
    found = list(rows(root)) if os.path.exists(os.path.join(root, TABLE)) else []
    if not found:
        yield f"{TABLE}: no rows below '{HEADING}'"
    for number, cells in found:
        for complaint in wrong_in(root, cells, tests):
            yield f"{TABLE}:{number}: {complaint}"


if __name__ == "__main__":
    tree.run(check)
