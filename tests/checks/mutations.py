#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Each mutation of the plant tier (tests/plant/mutations) still applies to the product."""

import os
import subprocess

import tree

FOLDER = "tests/plant/mutations"


def check(root):
    for path in tree.files(root, (".diff",)):
        if not path.startswith(FOLDER):
            continue
        applied = subprocess.run(["git", "apply", "--check", os.path.join(os.path.abspath(root), path)], cwd=root,
                                 env=dict(os.environ, GIT_CEILING_DIRECTORIES=os.path.dirname(os.path.abspath(root))),
                                 text=True, capture_output=True, check=False)
        if applied.returncode != 0:
            yield f"{path}: does not apply any more: make it anew for the line as it is now ({applied.stderr.strip()})"


if __name__ == "__main__":
    tree.run(check)
