#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Every folder has a README.md that describes its contents. A corpus is described by the folder above it."""

import os

import tree

DATA_FOLDERS = {"corpus"}


def check(root):
    for folder, _, files in tree.walk(root):
        if DATA_FOLDERS.intersection(folder.split(os.sep)):
            continue
        if "README.md" not in files:
            yield f"{folder}: no README.md"
        elif os.path.getsize(os.path.join(root, folder, "README.md")) == 0:
            yield f"{folder}: an empty README.md"


if __name__ == "__main__":
    tree.run(check)
