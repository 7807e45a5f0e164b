#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""The headers that the library installs (LINEGATE_PUBLIC_HEADERS of stack/CMakeLists.txt) exist, and include only
installed headers of stack/. The guide of the library (deploy/library/README.md) shows its examples exactly as
compiled."""

import os
import re

import tree

LIST = "stack/CMakeLists.txt"
HEADERS = re.compile(r"set\(LINEGATE_PUBLIC_HEADERS\s+([^)]*)\)")
INCLUDE = re.compile(r'^#include "(stack/[^"]+)"', re.MULTILINE)

GUIDE = "deploy/library/README.md"
EXAMPLE = re.compile(r"^`(\w+\.cpp)`:\n\n```cpp\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def public_headers(root):
    match = HEADERS.search(tree.read(root, LIST))
    return [f"stack/{name}" for name in match[1].split()] if match else []


def check_headers(root):
    public = public_headers(root)
    if not public:
        yield f"{LIST}: no list LINEGATE_PUBLIC_HEADERS"
    for header in public:
        if not os.path.exists(os.path.join(root, header)):
            yield f"{LIST}: {header} does not exist"
            continue
        for included in INCLUDE.findall(tree.read(root, header)):
            if included not in public:
                yield f"{header}: includes {included}, which {LIST} does not install"


def check_examples(root):
    folder = os.path.dirname(GUIDE)
    shown = dict(EXAMPLE.findall(tree.read(root, GUIDE)))
    for path in tree.files(root, (".cpp",)):
        name = os.path.basename(path)
        if os.path.dirname(path) == folder and shown.pop(name, None) != tree.read(root, path):
            yield f"{GUIDE}: does not show {name} as it is"
    for name in shown:
        yield f"{GUIDE}: shows {name}, which does not exist"


def check(root):
    yield from check_headers(root)
    yield from check_examples(root)


if __name__ == "__main__":
    tree.run(check)
