# SPDX-License-Identifier: Apache-2.0
"""Shared by all checks: the files of the repository, complaints, and a main program."""

import os
import sys

SOURCES = (".h", ".cpp", ".c", ".idl")
# Not checked: version control, builds, editors.
SKIPPED = {"build", "__pycache__"}


def walk(root):
    """Yields (folder, folders in it, files in it), relative to root, '.' being root itself."""
    for folder, folders, files in os.walk(root):
        folders[:] = sorted(f for f in folders if f not in SKIPPED and not f.startswith("."))
        yield os.path.relpath(folder, root), folders, sorted(files)


def files(root, suffixes=None):
    """Yields the paths of all files, relative to root; with suffixes only those with such an end."""
    for folder, _, names in walk(root):
        for name in names:
            if suffixes is None or name.endswith(suffixes):
                yield os.path.normpath(os.path.join(folder, name))


def lines(root, path):
    """Yields (number from 1, line) of a text file; nothing for a file that is not text."""
    try:
        with open(os.path.join(root, path), encoding="utf-8") as text:
            yield from enumerate(text.read().splitlines(), start=1)
    except UnicodeDecodeError:
        return


def read(root, path):
    """Returns the whole text of a file."""
    with open(os.path.join(root, path), encoding="utf-8") as text:
        return text.read()


def run(check):
    """Prints the complaints of check(root); exits with 1 if there are any."""
    here = os.path.dirname(os.path.abspath(__file__))
    root = sys.argv[1] if len(sys.argv) > 1 else os.path.join(here, "..", "..")
    complaints = list(check(os.path.realpath(root)))
    for complaint in complaints:
        print(complaint)
    print(f"{len(complaints)} complaints")
    sys.exit(1 if complaints else 0)
