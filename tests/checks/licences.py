#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Every source file has its SPDX licence identifier in the first line, in a script after the interpreter line.
Device files, corpora, other data, documents, XML and JSON have none."""

import os

import tree

IDENTIFIER = "SPDX-License-Identifier: Apache-2.0"
# Start of a comment, by the end of the file name. A file that begins with #! is a script, whatever its name.
COMMENTS = {
    **dict.fromkeys(tree.SOURCES + (".cpp.in", ".js"), "// "),
    **dict.fromkeys((".py", ".sh", ".bash", ".cmake", ".yaml", "CMakeLists.txt"), "# "),
}
DATA_FOLDERS = {"corpus"}


def comment_of(path, first):
    """Returns the start of a comment in this file; None for a file without an SPDX line."""
    if first.startswith("#!"):
        return "# "
    return next((comment for end, comment in COMMENTS.items() if path.endswith(end)), None)


def check(root):
    for path in tree.files(root):
        if DATA_FOLDERS.intersection(path.split(os.sep)):
            continue
        head = [line for number, line in tree.lines(root, path) if number <= 2] + ["", ""]
        comment = comment_of(path, head[0])
        number = 2 if head[0].startswith("#!") else 1
        if comment is not None and head[number - 1] != comment + IDENTIFIER:
            yield f"{path}:{number}: not '{comment}{IDENTIFIER}'"


if __name__ == "__main__":
    tree.run(check)
