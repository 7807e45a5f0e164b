#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""With another gateway as master, two lines of a second gateway observe the bus: one has the DCF of the device, one
only its EDS and learns the mapping of the PDOs from the master's SDO transfers. Both publish the image of the
master, byte for byte. Each line is connected to the bus through its own wire (vxcan and can-gw), on which only
frames from the observer can be seen: a witness there sees none."""

import os
import subprocess

from actors import FOLDER, Actor, Site, Witness, check, eventually, play, run, send, write_file

NODE = 12
EDS = os.path.abspath(os.path.join(os.path.dirname(__file__), "../../../bridges/sim/eds/digital-io.eds"))
DCF = os.path.join(FOLDER, "doors.dcf")
WIRES = {"files": ("obs0", "wire0"), "heard": ("obs1", "wire1")}
LINES = ("hall", *WIRES)
OUTPUTS = "doors.Write output 8-bit.Outputs "

MASTER = """\
schema: 1
gateway: {{name: master}}
lines:
  - name: hall
    interface: socketcan:vcan0
    bit_rate: 500kbit
    heartbeat: 1s
    access: all
    nodes:
      - {{id: 12, name: doors, {file}, heartbeat: 2s{pdos}}}
"""
# The identifiers, objects and order differ from those of the EDS.
PDOS = """, pdos: {tpdo1: {cob_id: 0x1AC, map: ["6000:3", "6000:1"]}, \
rpdo1: {cob_id: 0x2AC, map: ["6200:2", "6200:1"]}}"""
OBSERVER = """\
schema: 1
gateway: {name: watch}
lines:
  - name: files
    interface: socketcan:obs0
    bit_rate: 500kbit
    role: observer
    node_id: 127
    access: all
    nodes: [{id: 12, name: doors, dcf: doors.dcf, heartbeat: 2s}]
  - name: heard
    interface: socketcan:obs1
    bit_rate: 500kbit
    role: observer
    node_id: 127
    access: all
    nodes: [{id: 12, name: doors, eds: EDS, heartbeat: 2s}]
"""


def make_wire(end, wire):
    """Frames on vcan0 arrive at `end`; frames sent there appear at `wire`, and on vcan0."""
    for command in (
        f"ip link add {end} type vxcan peer name {wire}",
        f"ip link set {end} up",
        f"ip link set {wire} up",
        f"cangw -A -s vcan0 -d {wire}",
        f"cangw -A -s {wire} -d vcan0",
    ):
        subprocess.run(command.split(), check=True)
    return Witness(wire)


class Bus(Site):
    def __init__(self):
        super().__init__()
        self.bus = Witness("vcan0")
        self.wires = {line: make_wire(*ends) for line, ends in WIRES.items()}
        self.write_dcf()
        self.device = self.simulate()
        self.observer = self.gateway("observer", OBSERVER.replace("EDS", EDS))
        eventually("the observers listen", lambda: self.observer.text().count("started as observer") == 2)
        self.master = self.gateway("master", MASTER.format(file="dcf: doors.dcf", pdos=""))

    def simulate(self):
        return Actor("device", self.programs.linegate, "simulate", "socketcan:vcan0", "--device", f"digital-io:{NODE}")

    def write_dcf(self):
        plant = write_file("mapping.yaml", MASTER.format(file=f"eds: {EDS}", pdos=PDOS))
        status, text = run(self.programs.linegate, "dcf", plant, "hall:doors")
        check("the mapping is written into a DCF", status == 0)
        write_file("doors.dcf", text)

    def node(self, line):
        return next((node for node in self.command("nodes", line) if node["node"] == NODE), {})

    def image(self, line, *options):
        image = self.command("image", *options, line)
        entries = [
            (entry["name"], entry["index"], entry["sub"], entry["bit_offset"], entry["valid"])
            for entry in image["entries"] or []
        ]
        return image.get("layout_id"), image.get("bytes"), entries

    def all_same(self, *options, lines=LINES):
        """Returns the image that all of these lines publish now: layout, bytes, and which values are valid."""
        images = [self.image(line, *options) for line in lines]
        layout, octets, entries = images[0]
        same = octets is not None and entries != [] and images.count(images[0]) == len(lines)
        return (layout, octets, [entry[-1] for entry in entries]) if same else None

    def all_valid(self):
        """Whether every line has the same layout, with a valid value in each entry."""
        places = []
        for line in LINES:
            layout, _, entries = self.image(line)
            places.append((layout, entries))
            if entries == [] or not all(entry[-1] for entry in entries):
                return False
        return places.count(places[0]) == len(LINES)

    def everywhere(self, member, value):
        return all(self.node(line).get(member) == value for line in LINES)

    def silent(self):
        return all(witness.frames() == [] for witness in self.wires.values())


def the_image_is_that_of_the_master(bus):
    eventually("the node is operational for all", lambda: bus.everywhere("state", "operational"))
    eventually("the inputs have one layout, and values", bus.all_valid)
    bus.held_back("write", "hall", OUTPUTS + "1 to 8", "0xA5")
    bus.command("write", "hall", OUTPUTS + "9 to 16", "0x5A")
    _, octets, valid = eventually("the outputs are the same", lambda: bus.all_same("--outputs"))
    check(f"{octets}: they are those written, as mapped", bytes.fromhex(octets) == b"\x5a\xa5" and all(valid))
    bus.bus.await_frame(0x2AC, b"\x5a\xa5")


def the_values_of_a_dead_node_are_the_same(bus):
    """While the node lives its values change, so three consecutive images would differ."""
    bus.device.kill()
    eventually("the dead node is missing for all", lambda: bus.everywhere("presence", "missing"))
    _, octets, valid = eventually("the inputs are the same", bus.all_same)
    bus.bus.catch_up("vcan0")
    last = bus.bus.frames(0x1AC)[-1][2] + bus.bus.frames(0x28C)[-1][2]
    check(f"{octets}: those of its last PDOs, and not valid", bytes.fromhex(octets) == last and not any(valid))
    send("vcan0", "1AC#A1B2")
    described = [line for line in LINES if line != "heard"]
    eventually(
        "a frame in its name is where its DCF has the mapping",
        lambda: (bus.all_same(lines=described) or ("", ""))[1].startswith("A1B2"),
    )
    # The master has reset the node, so it may have its default mapping.
    check("not where the mapping was heard", not (bus.image("heard")[1] or "A1B2").startswith("A1B2"))
    bus.device = bus.simulate()
    eventually("the node is back for all", lambda: bus.everywhere("state", "operational"))
    eventually("with values", bus.all_valid)


def the_observer_sends_nothing(bus):
    for words in (
        ("nmt", "stop", f"heard:{NODE}"),
        ("sdo", "read", f"files:{NODE}", "1000", "0", "u32"),
        ("write", "files", OUTPUTS + "1 to 8", "1"),
    ):
        said = bus.refused(*words)
        check(f"refused: {' '.join(words)}: {said.strip()}", "role" in said)
    check("the observer ends well", bus.observer.stop() == 0)
    check(f"no frame of it among {len(bus.bus.frames())}", bus.silent())
    for line, (end, _) in WIRES.items():
        send(end, "7DF#01")
        eventually(f"{line}: the witness would have seen one", lambda: len(bus.wires[line].frames(0x7DF)) == 1)
    check("the master ends well", bus.master.stop() == 0)


def scenario():
    bus = Bus()
    the_image_is_that_of_the_master(bus)
    the_values_of_a_dead_node_are_the_same(bus)
    the_observer_sends_nothing(bus)


play(scenario)
