#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Writes the kept inputs of the target plant_yaml: the sample plants, and every configuration in the tests of
gateway/config, valid and invalid ones.

usage: plant_seeds.py FOLDER
"""
import ast
import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
LITERAL = r'"(?:[^"\\\n]|\\.)*"'
RAW = r'R"\((.*?)\)"'
NAME_BEFORE = re.compile(r'(?:\{"(\w+)",|TEST\(\w+, (\w+)\))')


def configurations(source):
    """Yields (name, text) of the string literals that are the YAML of a plant, with adjacent literals joined."""
    for match in re.finditer(rf'{RAW}|{LITERAL}(?:\s*{LITERAL})*', source, re.DOTALL):
        text = match.group(1)
        if text is None:
            text = "".join(ast.literal_eval(part) for part in re.findall(LITERAL, match.group(0)))
        if text.startswith(("schema:", "gateway:")):
            names = NAME_BEFORE.findall(source, 0, match.start())
            yield "".join(names[-1]) if names else "plant", text


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    folder = pathlib.Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    for plant in sorted((ROOT / "deploy/plants").glob("*.yaml")):
        (folder / plant.name).write_text(plant.read_text())
    seen = {}
    for test in sorted((ROOT / "tests/gateway/config").glob("*_test.cpp")):
        for name, text in configurations(test.read_text()):
            seen[name] = seen.get(name, 0) + 1
            suffix = f"-{seen[name]}" if seen[name] > 1 else ""
            # The target reads files relative to deploy/plants, the tests relative to the root.
            text = re.sub(r"(?<![\w/.])bridges/sim/eds/", "../../bridges/sim/eds/", text)
            (folder / f"test-{name}{suffix}.yaml").write_text(text)


if __name__ == "__main__":
    main()
