#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Short files with one subject: none has more than 600 lines, but for the contract, which is one file."""

import tree

LIMIT = 600
LIMITS = {"idl/linegate.idl": 1000}


def check(root):
    for path in tree.files(root, tree.SOURCES + (".py", ".sh", ".cmake")):
        length = sum(1 for _ in tree.lines(root, path))
        limit = LIMITS.get(str(path), LIMIT)
        if length > limit:
            yield f"{path}: {length} lines, more than {limit}"


if __name__ == "__main__":
    tree.run(check)
