#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Named topics of linegated, read by Cyclone DDS with types that idlc generated from what `linegate idl` printed, and those
for ROS 2 with types of its message package. The device is a line of the same gateway; the values are the defaults of
the outputs of both. A device of ours does not send a DOMAIN, so that input has no value. Afterwards Cyclone DDS writes
some of the outputs by name. All of it with DDS in the process of the gateway, and in one of its own.

named.py LINEGATED LINEGATE PROFILES CYCLONE_PROGRAM...
"""

import json
import os
import subprocess
import sys
import tempfile

FOLDER = os.path.dirname(os.path.abspath(__file__))
NAMED = os.path.join(FOLDER, "..", "bridges", "named")
CYCLONE = "file://" + os.path.join(FOLDER, "cyclone.xml")

VALUES = {
    "Flag": "true",
    "Second flag": "false",
    "class": "-5",
    "24V supply": "240",
    "Signed 16": "-300",
    "Unsigned 16": "65000",
    "Signed 24": "-70000",
    "Unsigned 24": "16000000",
    "Signed 32": "-2000000000",
    "Unsigned 32": "4000000000",
    "Signed 40": "-500000000000",
    "Unsigned 40": "1000000000000",
    "Signed 48": "-100000000000000",
    "Unsigned 48": "200000000000000",
    "Signed 56": "-30000000000000000",
    "Unsigned 56": "70000000000000000",
    "Signed 64": "-9000000000000000000",
    "Unsigned 64": "18000000000000000000",
    "Real 64": "-0.1",
    "Real 32 (m/s)": "1.5",
    "Visible": "Press 01",
    "Octets": "00 01 02 03 FC FD FE FF",
    "Unicode": "AC 20 35 00 20 00 6D 00",
    "Time of day": "81 EE 36 00 3A 3D",
    "Duration": "02 00 00 00 01 00",
    "Domain": "01 02 03 04 05 06 07 08",
}

PLANT = """schema: 1
gateway: {{name: types}}
dds: {{domain: {domain}, process: {process}}}
lines:
  - name: press
    interface: "virtual:types"
    access: all
    named: {{ros2: true}}
    nodes: [{{id: 5, name: every, eds: {eds}, heartbeat: 100ms}}]
    outputs:
      groups: [{{name: all, written_by: named, entries: [every.*]}}]
      defaults: {outputs}
  - name: device
    interface: "virtual:types"
    role: device
    devices: [{{id: 5, name: every, eds: {eds}}}]
    outputs: {{defaults: {inputs}}}
"""


def defaults(prefix):
    """JSON is YAML."""
    return json.dumps({f"every.{prefix}{name}": value for name, value in VALUES.items()})


def run(folder, process, linegated, linegate, profiles, *readers):
    domain = str(230 + os.getpid() % 3)
    plant = os.path.join(folder, "plant.yaml")
    with open(plant, "w", encoding="utf-8") as file:
        file.write(PLANT.format(domain=domain, process=process, eds=os.path.join(NAMED, "every_type.eds"), outputs=defaults("Set "),
                                inputs=defaults("")))
    printed = subprocess.run([linegate, "idl", plant, "press"], capture_output=True, text=True, timeout=60, check=False)
    with open(os.path.join(NAMED, "every_type.idl"), encoding="utf-8") as file:
        if printed.stdout != file.read().partition("\n")[2]:  # without its licence
            return f"linegate idl does not print every_type.idl:\n{printed.stderr}"
    with subprocess.Popen([linegated, plant, "--dds-profile", profiles]) as gateway:
        try:
            environment = dict(os.environ, CYCLONEDDS_URI=CYCLONE)
            wrong = [os.path.basename(reader) for reader in readers
                     if subprocess.run([reader, domain], env=environment, timeout=90, check=False).returncode != 0]
        finally:
            gateway.terminate()
            gateway.wait(timeout=30)
    return f"process {process}: wrong are {', '.join(wrong)}" if wrong else None


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as temporary:
        sys.exit(run(temporary, "same", *sys.argv[1:]) or run(temporary, "own", *sys.argv[1:]))
