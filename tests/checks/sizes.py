#!/usr/bin/python3
"""Short files with one subject: none has more than 600 lines."""

import tree

LIMIT = 600


def check(root):
    for path in tree.files(root, tree.SOURCES + (".py", ".sh", ".cmake")):
        length = sum(1 for _ in tree.lines(root, path))
        if length > LIMIT:
            yield f"{path}: {length} lines, more than {LIMIT}"


if __name__ == "__main__":
    tree.run(check)
