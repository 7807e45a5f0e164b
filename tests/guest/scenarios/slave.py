#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""A line whose own node is an NMT slave (the slave mode of the IXXAT manual), by its own values and by its role,
with a foreign master (npm's `canopen`): the master resets, starts and stops it, and reads its objects; the line
sends no NMT command, whatever resets its node, and observes the other node."""

import struct

from actors import Site, Witness, check, eventually, play
from python_stranger import PythonStranger
from stranger import Stranger

OWN, LAST, MASTER, DEVICE = 20, 127, 100, 5
PLANT = f"""\
schema: 1
gateway: {{name: guest}}
lines:
  - name: hall
    interface: socketcan:vcan0
    bit_rate: 500kbit
    node_id: {OWN}
    access: all
    heartbeat: 250ms
    own_values: {{1F80:0: 0}}
"""
ROLE_PLANT = """\
schema: 1
gateway: {{name: guest}}
lines:
  - name: pack
    interface: socketcan:vcan1
    bit_rate: 500kbit
    role: device
    node_id: 127
    access: all
    heartbeat: 250ms
    nodes: [{{id: 5, name: other, eds: {eds}, heartbeat: 2s}}]
"""
OPERATIONAL, STOPPED = 5, 4


class Hall(Site):
    """The master, the gateway and a witness on one interface."""

    def __init__(self, interface, own, plant):
        super().__init__("modules")
        self.interface, self.own = interface, own
        self.bus = Witness(interface)
        self.master = Stranger(interface, MASTER, self.programs.modules, "plc")
        check("the master is ready", self.master.next_answer() == {"ready": True})
        self.linegated = self.gateway(f"line-{own}", plant)
        eventually("the own node booted", lambda: self.bus.boot_ups(own) > 0)

    def commanded(self, command):
        """Sends an NMT command of the master, and waits until the own node boots again."""
        booted = self.bus.boot_ups(self.own)
        self.master.nmt(command, self.own)
        eventually(f"{command} by the master", lambda: self.bus.boot_ups(self.own) > booted)

    def heard(self, state):
        return self.bus.frames(0x700 + self.own)[-1][2] == bytes([state])

    def only_the_master_commands(self, line, others=()):
        said = self.refused("nmt", "reset-node", f"{line}:all")
        print(f"ok: what a console commands to others is refused: {said}")
        self.commanded("resetNode")
        self.bus.catch_up(self.interface)
        sent = [data for _, _, data in self.bus.frames(0x000)]
        own = [bytes([command, self.own]) for command in (0x81, 0x82, 0x01, 0x02, 0x81)]
        check(f"the bus had the master's NMT commands and no other: {sent}", sent == [*others, *own])

    def obeys(self):
        self.commanded("resetNode")
        self.commanded("resetCommunication")
        self.master.nmt("startNode", self.own)
        eventually("it is operational", lambda: self.heard(OPERATIONAL))
        self.master.nmt("stopNode", self.own)
        eventually("it is stopped", lambda: self.heard(STOPPED))


def by_its_own_values():
    hall = Hall("vcan0", OWN, PLANT)
    hall.obeys()
    hall.only_the_master_commands("hall")
    check("the gateway ends well", hall.linegated.stop() == 0)


def by_its_role():
    """The own node answers the master's SDO requests, and the line observes another node."""
    device = PythonStranger("vcan1", DEVICE)
    pack = Hall("vcan1", LAST, ROLE_PLANT.format(eds=device.eds))
    check("the master reads 1000h", pack.master.upload(LAST, 0x1000, 0) == struct.pack("<I", 0x195))
    check("the node is no master", pack.master.upload(LAST, 0x1F80, 0) == struct.pack("<I", 4))
    said = pack.refused("sdo", "read", "pack:5", "1000:0")
    print(f"ok: SDO to other nodes is the master's: {said}")
    check("the device has a heartbeat", pack.master.download(DEVICE, 0x1017, 0, struct.pack("<H", 2000)) is None)
    pack.master.nmt("startNode", DEVICE)

    def observed():
        return any(node["node"] == DEVICE and node["state"] == "operational" for node in pack.command("nodes", "pack"))

    eventually("the device is observed", observed)
    pack.obeys()
    pack.only_the_master_commands("pack", [bytes([0x01, DEVICE])])
    device.power_off()
    eventually(
        "its loss is observed",
        lambda: any(n["node"] == DEVICE and n["presence"] != "present" for n in pack.command("nodes", "pack")),
    )
    asked = [data for _, _, data in pack.bus.frames(0x600 + DEVICE)]
    check(f"only the master sent SDO requests: {asked}", all(data[1:3] == b"\x17\x10" for data in asked))
    check("the gateway ends well", pack.linegated.stop() == 0)


def scenario():
    by_its_own_values()
    by_its_role()


play(scenario)
