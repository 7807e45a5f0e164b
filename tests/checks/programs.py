#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""tests/run builds each program that the tier dds runs, before it runs this tier. A folder that was built before has
the program anyway, so that only a new clone shows what is missing."""

import os
import re

import tree

RUN = "tests/run"
# Their tests are of this tier; tests/run builds the other folders whole.
FOLDERS = (os.path.join("tests", "dds"), os.path.join("tests", "gateway"))
SET = re.compile(r"\n\s*programs\)\n(.*?);;", re.DOTALL)
RUN_BY_TEST = re.compile(r"\$<TARGET_FILE:(\w+)>")
OF_TIER = re.compile(r"linegate(?:_gateway)?_test\((\w+) TIER dds\b")
WITH = re.compile(r"add_dependencies\((\w+) ([\w\s]+)\)")


def check(root):
    found = SET.search(tree.read(root, RUN))
    built = set(re.findall(r"\w+", found[1])) if found else set()
    texts = {path: tree.read(root, path) for path in tree.files(root, ("CMakeLists.txt",)) if path.startswith(FOLDERS)}
    for text in texts.values():
        for program, others in WITH.findall(text):
            if program in built:
                built.update(others.split())
    for path, text in texts.items():
        for program in sorted(set(RUN_BY_TEST.findall(text)) | set(OF_TIER.findall(text))):
            if program not in built:
                yield f"{path}: a test of the tier dds runs {program}, which is not in the set programs of {RUN}"


if __name__ == "__main__":
    tree.run(check)
