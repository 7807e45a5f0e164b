#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""C++ is formatted as .clang-format says (clang-format 14)."""

import os
import subprocess

import tree


def check(root):
    sources = [os.path.join(root, path) for path in tree.files(root, (".h", ".cpp", ".c"))]
    if not sources:
        return
    command = ["clang-format", "--dry-run", "-Werror", "--ferror-limit=1", *sources]
    result = subprocess.run(command, capture_output=True, text=True, check=False)
    found = [line for line in result.stderr.splitlines() if ": error: " in line]
    for line in found:
        yield os.path.relpath(line, root) + " (run clang-format -i)"
    if result.returncode != 0 and not found:
        yield f"clang-format: {result.stderr.strip()}"


if __name__ == "__main__":
    tree.run(check)
