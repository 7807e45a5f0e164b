#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""An SDO connection between two devices (CiA 302-5), from plant.yaml to linegate: a gateway manages a bus, and has the
devices on it as a second line. The records of the devices show what was written.

connections.py LINEGATED LINEGATE PROFILES
"""

import os

from plant_process import EDS, Plant, expect, own_domain, run_test, until, write

PLANT = """schema: 1
gateway: {name: connected}
lines:
  - name: press
    interface: virtual:press
    bit_rate: 1Mbit
    access: all
    sdo_connections: {first: 0x6A0, last: 0x6A3}
    nodes:
      - {id: 10, name: arm, eds: connected.eds, heartbeat: 200ms}
      - {id: 11, name: gripper, eds: connected.eds, heartbeat: 200ms}
  - name: devices
    interface: virtual:press
    bit_rate: 1Mbit
    access: all
    role: device
    devices:
      - {id: 10, name: arm, eds: connected.eds}
      - {id: 11, name: gripper, eds: connected.eds}
"""
NOT_VALID = 0x80000000
DYNAMIC = 0x40000000


def record(index):
    """An SDO client or server as a device file describes it."""
    types = {0: ("0x0005", "const", "3"), 1: ("0x0007", "rw", hex(NOT_VALID)), 2: ("0x0007", "rw", hex(NOT_VALID)),
             3: ("0x0005", "rw", "0")}
    text = f"[{index:X}]\nParameterName=SDO\nObjectType=0x9\nSubNumber=4\n\n"
    for sub, (kind, access, value) in types.items():
        text += (f"[{index:X}sub{sub}]\nParameterName=Sub {sub}\nObjectType=0x7\nDataType={kind}\nAccessType={access}\n"
                 f"DefaultValue={value}\nPDOMapping=0\n\n")
    return text


def device_file():
    with open(os.path.join(EDS, "encoder.eds"), encoding="utf-8") as file:
        text = file.read()
    head, tail = text.split("[OptionalObjects]\nSupportedObjects=28\n")
    listed = "[OptionalObjects]\nSupportedObjects=30\n29=0x1201\n30=0x1280\n"
    return head + listed + tail + "\n" + record(0x1201) + record(0x1280)


class Connected(Plant):
    def cob_id(self, node, index, sub):
        return int(self.json("sdo", "read", f"press:{node}", f"{index:X}", str(sub), "u32")["value"])

    def records(self):
        """The COB-IDs of the client, then those of the server."""
        return [self.cob_id(10, 0x1280, 1), self.cob_id(10, 0x1280, 2), self.cob_id(11, 0x1201, 1),
                self.cob_id(11, 0x1201, 2)]

    def table(self):
        return self.json("connections", "press")["connections"]


def opened_and_closed(plant):
    expect("at first", plant.table(), [])
    plant.command("connections", "press", "open", "arm", "gripper")
    opened = {"number": 1, "client": 10, "server": 11, "client_record": 0x1280, "server_record": 0x1201,
              "request": 0x6A1, "response": 0x6A0, "state": "open"}
    expect("opened", plant.table(), [opened])
    expect("valid", plant.records(), 2 * [DYNAMIC | 0x6A1, DYNAMIC | 0x6A0])
    told = plant.command("connections", "press", "open", "10", "11", code=1)
    expect("no other record", "060A0023" in told.stderr.upper() or "SDO connection" in told.stderr, True)
    plant.command("sdo", "write", "press:11", "1005", "0", "u32", str(0x6A2), code=1)  # of the pool
    plant.command("connections", "press", "close", "1")
    expect("closed", plant.table(), [])
    expect("not valid", plant.records(), 4 * [NOT_VALID])
    plant.command("connections", "press", "close", "1", code=1)
    plant.command("connections", "press", "open", "10", code=2)
    plant.command("connections", "devices", "open", "10", "11", code=1)  # no manager


def lost(plant):
    plant.command("connections", "press", "open", "arm", "gripper")
    plant.command("nmt", "reset-communication", "press:11")
    until("the connection is released", lambda: plant.table() == [])
    plant.await_operational("press", 2, "after the reset")
    expect("not valid", plant.records(), 4 * [NOT_VALID])
    events = [event for event in plant.stream("events", "press", "--once") if event["kind"] == "sdo-connection"]
    expect("events", [event["value"] for event in events], [0, 2, 1, 0, 3])


def test(folder, linegated, linegate, profiles):
    plant = Connected(linegated, linegate, profiles, own_domain())
    write(os.path.join(folder, "connected.eds"), device_file())
    with plant.running(write(os.path.join(folder, "plant.yaml"), PLANT)):
        plant.await_operational("press", 2)
        opened_and_closed(plant)
        lost(plant)


if __name__ == "__main__":
    run_test(test)
