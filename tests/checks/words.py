#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""The tree contains nothing unfinished: no words that announce later work, and no disabled tests."""

import os
import re

import tree

FORBIDDEN = re.compile(
    r"\b(TODO|FIXME|XXX|HACK|GTEST_SKIP|DISABLED_\w+|not (yet )?implemented|unimplemented|for now|placeholder)\b"
)
TEXTS = tree.SOURCES + (".py", ".sh", ".cmake", ".md", ".yaml", ".xml", "CMakeLists.txt")
# These two files must contain the words to search for.
EXEMPT = {os.path.join("tests", "checks", name) for name in ("words.py", "self_test.py")}


def check(root):
    for path in tree.files(root, TEXTS):
        if path in EXEMPT:
            continue
        for number, line in tree.lines(root, path):
            found = FORBIDDEN.search(line)
            if found:
                yield f"{path}:{number}: '{found[0]}'"


if __name__ == "__main__":
    tree.run(check)
