#!/usr/bin/python3
"""Prints plant.yaml(5), made from deploy/plant.schema.json: the manual and the editor say the same.

plant_manual.py SCHEMA VERSION
"""

import json
import sys

HEAD = """.TH PLANT.YAML 5 "" "linegate {version}" "Linegate"
.SH NAME
plant.yaml \\- the lines of a CANopen gateway
.SH DESCRIPTION
.BR linegated (8)
runs the lines that this file describes. It is YAML; times and rates carry their unit
.RI ( 100ms ", " 500kbit ).
File names are relative to the file itself.
.B linegate check
.I FILE
says what would be run, and tells every mistake with file, line and column.
.PP
The service reads
.IR /etc/linegate/plant.yaml .
After
.B systemctl reload linegated
only lines that changed are restarted; a file with mistakes changes nothing.
"""
TAIL = """.SH EXAMPLE
.EX
schema: 1
gateway: {name: hall-7}
lines:
  - name: press
    interface: socketcan:can0
    bit_rate: 500kbit
    access: all
    nodes:
      - {id: 5, name: inlet, eds: inlet.eds, heartbeat: 200ms}
.EE
.SH FILES
.TP
.I /usr/share/linegate/plants
samples to start from
.TP
.I /usr/share/linegate/plant.schema.json
the JSON Schema that this page is made from
.SH SEE ALSO
.BR linegated (8),
.BR linegate (1)
"""


def roff(text):
    text = text.replace("\\", "\\e").replace("-", "\\-")
    return "\\&" + text if text.startswith((".", "'")) else text


def choices(schema, definitions):
    """What a value may be, in a few words; empty if its description says all."""
    if "$ref" in schema:
        name = schema["$ref"].rsplit("/", 1)[1]
        return "a duration" if name == "duration" else choices(definitions[name], {})
    if "enum" in schema:
        return " | ".join(value for value in schema["enum"] if isinstance(value, str))
    if "minimum" in schema and "maximum" in schema:
        return f"{schema['minimum']} .. {schema['maximum']}"
    return "true | false" if schema.get("type") == "boolean" else ""


def list_of(schema):
    items = schema.get("items", {})
    return f"A list; see EACH {items['$ref'].rsplit('/', 1)[1].upper()}" if "$ref" in items else ""


def entry(path, schema, definitions):
    """Nothing for what only holds other members."""
    words = [schema.get("description", ""), choices(schema, definitions), list_of(schema), str(schema.get("const", ""))]
    text = ". ".join(word for word in words if word)
    return f".TP\n.B {roff(path)}\n{roff(text)}\n" if text or "properties" not in schema else ""


def entries(schema, definitions, before=""):
    for name, member in schema.get("properties", {}).items():
        yield entry(before + name, member, definitions)
        yield from entries(member, definitions, before + name + ".")


def page(schema, version):
    definitions = schema["$defs"]
    yield HEAD.replace("{version}", version)
    yield ".SH THE FILE\n"
    yield from entries(schema, definitions)
    for name, definition in definitions.items():
        if "properties" in definition:
            yield f".SH EACH {name.upper()}\n"
            yield from entries(definition, definitions)
    yield TAIL


def main(schema, version):
    with open(schema, encoding="utf-8") as file:
        sys.stdout.write("".join(page(json.load(file), version)))


if __name__ == "__main__":
    main(*sys.argv[1:])
