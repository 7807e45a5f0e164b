#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""The manuals are complete: plant.yaml(5) has everything that the schema has, every key of the schema is in the
loader and in the operator's guide or a sample plant, every key of the loader in the schema, every visible command of the programs has an entry in its manual, every other
command and every option is in it, and idl/README.md lists each function of the IXXAT CANopen Manager that a header of
stack/line names."""

import json
import os
import re
import sys

import tree

SCHEMA = "deploy/plant.schema.json"
LOADER = "gateway/config"
GUIDES = ("deploy/OPERATING.md", "README.md", "deploy/plants")
DAEMON = "gateway/cli/linegated.cpp"
COMMANDS = "gateway/cli"  # all other files there are commands of linegate
PROGRAM_MANUALS = ("deploy/package/linegate.1", "deploy/package/linegated.8")
OPTION = re.compile(r'add_(?:option|flag)\w*\(\s*"((?:-\w,)?--[\w-]+)"')
# A key that the loader reads, as in section.read_number("node_id", ...) and section.find("nodes").
READ_KEY = re.compile(r'\b(?:read\w*|find|require)(?:<[^>]*>)?\(\s*(?:\w+,\s*)?"(\w+)"')
CONTRACT = "idl/README.md"
FUNCTION = re.compile(r"\bCMM_\w+")
COMMAND = re.compile(r'add_subcommand\(\s*"([\w-]+)"')
# A command of the program itself, not of another command; the name of its variable, if it has one.
TOP_COMMAND = re.compile(r'(?:(\w+)\s*=\s*)?(?:\w+\s*(?:\.|->)\s*)?\bapp(?:\(\)|_)?\s*(?:\.|->)\s*'
                         r'add_subcommand\(\s*"([\w-]+)"')


def plain(manual):
    """Returns the text of a manual page without its requests, fonts and escapes."""
    text = re.sub(r"^\.\w+ ?", "", manual, flags=re.MULTILINE)
    text = re.sub(r"\\f.", "", text).replace("\\-", "-").replace("\\&", "").replace("\\e", "\\").replace('"', "")
    return " ".join(text.split())


def parts(schema):
    """Returns the texts that the manual must contain: names of keys, descriptions, alternatives and ranges."""
    if isinstance(schema, list):
        for one in schema:
            yield from parts(one)
    if not isinstance(schema, dict):
        return
    for key in ("properties", "$defs"):
        for name, inner in schema.get(key, {}).items():
            if key == "properties":
                yield name
            yield from parts(inner)
    yield from (value for value in schema.get("enum", []) if isinstance(value, str))
    if "$ref" not in schema and "description" in schema:
        yield schema["description"]
    if "minimum" in schema and "maximum" in schema:
        yield f"{schema['minimum']} .. {schema['maximum']}"
    for key in ("items", "additionalProperties", "anyOf", "oneOf"):
        yield from parts(schema.get(key))
    yield from (part for inner in schema.get("patternProperties", {}).values() for part in parts(inner))


def keys(schema):
    """Returns the names of all keys of a plant.yaml."""
    if isinstance(schema, list):
        return set().union(*map(keys, schema)) if schema else set()
    if not isinstance(schema, dict):
        return set()
    return set(schema.get("properties", {})).union(*(keys(inner) for inner in schema.values()))


def guides(root):
    for path in GUIDES:
        full = os.path.join(root, path)
        names = sorted(os.listdir(full)) if os.path.isdir(full) else [""]
        yield from (tree.read(root, os.path.join(path, name).rstrip("/")) for name in names)


def check_loader(root, known):
    """known: the names of all keys of the schema."""
    quoted = set()
    for path in tree.files(root, (".cpp",)):
        if os.path.dirname(path) == LOADER:
            code = tree.read(root, path)
            quoted.update(re.findall(r'"(\w+)"', code))
            for key in sorted(set(READ_KEY.findall(code)) - known):
                yield f"{path}: {SCHEMA} has not the key {key}"
    for key in sorted(known - quoted):
        yield f"{SCHEMA}: no file of {LOADER} reads the key {key}"


def check_schema(root):
    sys.path.insert(0, os.path.join(root, "deploy", "package"))
    import plant_manual  # the module of the checked tree

    schema = json.loads(tree.read(root, SCHEMA))
    page = plain("".join(plant_manual.page(schema, "0")))
    for part in parts({**schema, "description": ""}):
        if " ".join(part.replace('"', "").split()) not in page:
            yield f"{SCHEMA}: plant.yaml(5) has not \"{part}\""
    text = "\n".join(guides(root))
    for key in sorted(keys(schema)):
        if not re.search(rf"\b{re.escape(key)}\b", text):
            yield f"{SCHEMA}: the key {key} is in none of {', '.join(GUIDES)}"
    yield from check_loader(root, keys(schema))


def programs(root):
    """Returns the manual of each file that defines options."""
    for source in tree.files(root, (".cpp",)):
        if source == DAEMON:
            yield source, PROGRAM_MANUALS[1]
        elif os.path.dirname(source) == COMMANDS:
            yield source, PROGRAM_MANUALS[0]


def entries(manual):
    """Returns the names of the paragraphs with a tag: the line after .TP, in bold alone."""
    return set(re.findall(r"^\.TP.*\n\.B ([\w-]+)$", manual.replace("\\-", "-"), flags=re.MULTILINE))


def visible_commands(code):
    """Returns the commands of a program that its help lists: those without an empty group."""
    for variable, command in TOP_COMMAND.findall(code):
        if not (variable and re.search(rf'\b{variable}->group\(""\)', code)):
            yield command


def check_programs(root):
    for source, manual in programs(root):
        page = tree.read(root, manual)
        text = plain(page)
        code = tree.read(root, source)
        for command in visible_commands(code):
            if command not in entries(page):
                yield f"{source}: {manual} has no entry (.TP, .B {command}) for the command {command}"
        for found in OPTION.findall(code):
            option = found.split(",")[-1]
            if not re.search(rf"(?<![\w-]){re.escape(option)}(?![\w-])", text):
                yield f"{source}: {manual} has not the option {option}"
        for command in set(COMMAND.findall(code)).difference(visible_commands(code)):
            if not re.search(rf"(?<![\w-]){re.escape(command)}(?![\w-])", text):
                yield f"{source}: {manual} has not the command {command}"


def check_functions(root):
    text = tree.read(root, CONTRACT)
    for path in tree.files(root, (".h",)):
        if path.startswith(os.path.join("stack", "line") + os.sep):
            for function in sorted(set(FUNCTION.findall(tree.read(root, path)))):
                if function not in text:
                    yield f"{path}: {CONTRACT} does not say how an application does {function}"


def check(root):
    yield from check_schema(root)
    yield from check_programs(root)
    yield from check_functions(root)


if __name__ == "__main__":
    tree.run(check)
