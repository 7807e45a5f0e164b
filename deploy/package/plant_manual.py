#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
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
File names are relative to the file itself. Anchors, aliases and merge keys
.RB ( << )
are those of YAML: a key of the mapping itself counts before one that is merged.
.B linegate check
.I FILE
prints the resulting configuration, and reports every error with file, line and column.
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


ALTERNATIVES = ("anyOf", "oneOf")
UNITS = "a duration with its unit: 0, 500us, 100ms, 1.5s; units ns, us, ms, s, min, h"


def alternatives(schema):
    """The forms that a value may have; a oneOf that only says which keys are required is none."""
    return next(([one for one in schema[key] if set(one) != {"required"}] for key in ALTERNATIVES if key in schema), [])


def form(schema, definitions):
    """One form of a value in words; empty if its description says all."""
    if "$ref" in schema:
        name = schema["$ref"].rsplit("/", 1)[1]
        if name == "duration":
            return UNITS
        whole = f"see EACH {name.upper()}"
        return whole if "properties" in definitions[name] else described(definitions[name], definitions)
    if alternatives(schema):
        return "; or ".join(words for words in (described(one, definitions) for one in alternatives(schema)) if words)
    if "enum" in schema:
        return " | ".join(value for value in schema["enum"] if isinstance(value, str))
    if "const" in schema:
        return str(schema["const"])
    if "minimum" in schema and "maximum" in schema:
        return f"{schema['minimum']} .. {schema['maximum']}"
    if schema.get("type") == "array":
        inner = described(schema.get("items", {}), definitions)
        return "a list" + (f", each: {inner}" if inner else "")
    if "properties" in schema:
        return "keys: " + ", ".join(schema["properties"])
    named = [inner for inner in named_members(schema).values() if form(inner, definitions)]
    if named:
        return "NAME: " + "; or NAME: ".join(form(inner, definitions) for inner in named)
    kinds = schema.get("type", [])
    kind = kinds if isinstance(kinds, str) else "/".join(sorted(kinds))
    return {"boolean": "true | false", "string": "a text", "integer": "a number"}.get(kind, "")


def named_members(schema):
    """The forms of members whose names the schema does not list, by what stands for the name."""
    out = dict(schema.get("patternProperties", {}))
    if isinstance(schema.get("additionalProperties"), dict):
        out["NAME"] = schema["additionalProperties"]
    return out


def described(schema, definitions):
    """A form with what its own description says of it."""
    words = form(schema, definitions)
    text = schema.get("description", "")
    return f"{words} ({text})" if words and text else words or text


def entry(path, schema, definitions):
    """Nothing for what only holds other members."""
    words = [schema.get("description", ""), form(schema, definitions)]
    if "properties" in schema:
        words.pop()
    text = ". ".join(word for word in words if word)
    return f".TP\n.B {roff(path)}\n{roff(text)}\n" if text or "properties" not in schema else ""


def entries(schema, definitions, before=""):
    """Of all members that are described in place, whatever the form of the value they belong to."""
    for name, member in schema.get("properties", {}).items():
        yield entry(before + name, member, definitions)
        yield from entries(member, definitions, before + name + ".")
    inner = [*alternatives(schema), *named_members(schema).values()]
    if isinstance(schema.get("items"), dict):
        inner.append(schema["items"])
    for one in inner:
        yield from entries(one, definitions, before)


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
