# SPDX-License-Identifier: Apache-2.0
"""Fragments of a plant.yaml, and the smallest plant that makes each whole."""

import os
import re
import shutil
import struct

from plant_process import EDS
from drive_program import program

HEAD = "schema: 1\ngateway: {name: whole}\n"
# Keys that stand at the top of a plant; a fragment that begins with another one belongs into a line.
TOP = ("schema", "gateway", "dds", "journal", "executors", "routes", "forward", "shared_objects", "lines")
# The device files that fragments name: copies of those of the simulated devices.
FILES = {"drive": "drive", "io": "digital-io", "valve": "digital-io", "old": "digital-io", "ram": "drive",
         "inlet": "digital-io", "scale": "analog-io"}
# An object that the drive of the operator's guide has beside those of the simulated one.
RECIPE = """
[2100]
ParameterName=Recipe
ObjectType=0x9
SubNumber=2

[2100sub0]
ParameterName=Highest sub-index supported
ObjectType=0x7
DataType=0x0005
AccessType=const
DefaultValue=1
PDOMapping=0

[2100sub1]
ParameterName=Number
ObjectType=0x7
DataType=0x0006
AccessType=rw
DefaultValue=5
PDOMapping=1
"""
# A line that fragments under a heading need beside their own.
NEIGHBOUR = """  - name: {name}
    interface: "virtual:{name}"
    network_id: {network}
    nodes: [{{id: 5, name: {node}, eds: {file}, heartbeat: 500ms}}]
"""
NEIGHBOURS = {
    "Below a PLC: devices of our own": (("machine", 101, "ram", "drive.eds"),),
    "Between networks: routes": (("hall", 102, "next", "io.eds"), ("pack", 103, "next", "io.eds")),
    "Values from line to line: forwarding": (("press", 101, "axis1", "drive.eds"), ("hall", 102, "display", "display.eds")),
    "From a line of another gateway": (("pack", 101, "display", "display.eds"),),
    "Networks of another gateway": (("hall", 101, "next", "io.eds"),),
}


def concise_dcf(index, sub, data):
    """A concise DCF (CiA 302-3) with one object."""
    return struct.pack("<IHBI", 1, index, sub, len(data)) + data


def make_files(folder):
    """Writes what fragments name: device files, concise DCFs, a program."""
    for name, profile in FILES.items():
        for path in (f"{name}.eds", f"devices/{name}.eds", f"devices/{name}.dcf"):
            shutil.copy(os.path.join(EDS, f"{profile}.eds"), os.path.join(folder, path))
    shutil.copy(os.path.join(EDS, "fd-io.eds"), folder)
    with open(os.path.join(EDS, "drive.eds"), encoding="utf-8") as file:
        drive = file.read()
    with open(os.path.join(folder, "display.eds"), "w", encoding="utf-8") as file:
        file.write(drive.replace("ParameterName=Target position\n", "ParameterName=Value\n"))
    with open(os.path.join(folder, "devices/recipe.eds"), "w", encoding="utf-8") as file:
        file.write(drive.replace("SupportedObjects=1\n1=0x2000\n", "SupportedObjects=2\n1=0x2000\n2=0x2100\n") + RECIPE)
    shutil.copy(os.path.join(EDS, "../../../tests/gateway/config/gate.eds"), os.path.join(folder, "gate.eds"))
    os.makedirs(os.path.join(folder, "device-files"))
    shutil.copy(os.path.join(EDS, "drive.eds"), os.path.join(folder, "device-files/drive.eds"))
    for name, content in (("valve7.cdc", concise_dcf(0x1017, 0, b"\xf4\x01")),
                          ("manager.cdcf", concise_dcf(0x1029, 1, b"\x00")),
                          ("drive.bin", program(0x00010002, 20_000)), ("drive-1.2.bin", program(0x00010002, 20_000))):
        with open(os.path.join(folder, name), "wb") as file:
            file.write(content)


def whole(heading, text):
    """The smallest plant with the fragment."""
    keys = re.findall(r"^(\w+):", text, re.MULTILINE)
    if "schema" in keys:
        return text
    if not set(keys) & set(TOP):
        nodes = "" if "nodes" in keys else "    nodes: [{id: 5, eds: drive.eds, heartbeat: 500ms}]\n"
        indented = re.sub(r"^(?=.)", "    ", text, flags=re.MULTILINE)
        return f'{HEAD}lines:\n  - name: press\n    interface: "virtual:press"\n    storage: stored\n{nodes}{indented}'
    if "lines" not in keys:
        text += "lines:\n"
    names = re.findall(r"^  - \{?name: (\w+)", text, re.MULTILINE)
    for name in names:
        line = re.search(rf"^  - \{{?name: {name}\b(?:.*\n?(?:    .*\n?)*)", text, re.MULTILINE)[0]
        if "interface:" not in line:
            text = text.replace(f"  - name: {name}\n", f'  - name: {name}\n    interface: "virtual:{name}"\n')
    for name, network, node, file in NEIGHBOURS.get(heading, ()):
        if name not in names:
            text += NEIGHBOUR.format(name=name, network=network, node=node, file=file)
    return HEAD + text
