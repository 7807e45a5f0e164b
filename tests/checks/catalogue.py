#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""stack/od/objects.h is the catalogue of CiA objects: no other file of the product defines a constant for an index of the
communication profile (1000h to 1FFFh), of the network variables (A000h to BFFFh) or of the objects for diagnosis (5F00h
to 5FFFh), and none writes such an index, or one of a device profile (6000h to 7FFFh), as the number of an address."""

import re

import tree

CATALOGUE = "stack/od/objects.h"
PRODUCT = ("stack/", "bridges/", "gateway/")
INDEX = r"0x(1[0-9A-Fa-f]{3}|5[Ff][0-9A-Fa-f]{2}|[AaBb][0-9A-Fa-f]{3})\b(?!')"
CONSTANT = re.compile(r"\bconstexpr\s+[\w:]+\s+(k\w+)\s*(?:=\s*|\{)" + INDEX)
PROFILE = r"0x([67][0-9A-Fa-f]{3})\b(?!')"
ADDRESS = re.compile(r"\{(?:" + INDEX + "|" + PROFILE + ")" + r",\s*(?:\d+|sub)\}")


def check(root):
    for path in tree.files(root, (".h", ".cpp")):
        if not path.startswith(PRODUCT) or path == CATALOGUE:
            continue
        for number, line in tree.lines(root, path):
            code = line.partition("//")[0]
            if match := CONSTANT.search(code):
                yield f"{path}:{number}: {match[1]} is {match[2]}h: use the constant of {CATALOGUE}, or define it there"
            elif match := ADDRESS.search(code):
                yield f"{path}:{number}: {match[1] or match[2]}h as a number: use the constant of {CATALOGUE}"


if __name__ == "__main__":
    tree.run(check)
