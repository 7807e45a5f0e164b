#!/usr/bin/python3
"""A foreign CANopen stack (npm's `canopen`) as SDO client of a simulated device and of a line's own node, and as
a device with an SDO server that the line boots and the console reads and writes. What the stranger stores in the
device, or in that node, is there after it was killed. In the end tshark's CANopen dissector looks at every frame."""

import argparse
import os
import struct

from actors import FOLDER, Actor, Witness, ask, check, eventually, play
from capture import malformed_frames
from stranger import Stranger

DEVICE, OWN, STRANGER = 5, 127, 20
SAVE, LOAD = b"save", b"load"
PLANT = """\
schema: 1
gateway: {{name: guest}}
lines:
  - name: mixed
    interface: socketcan:vcan0
    bit_rate: 500kbit
    access: all
    heartbeat: 500ms
    reset_nodes: false
    storage: {storage}
    nodes:
      - {{id: {node}, name: stranger, eds: {eds}}}
"""


def u16(number):
    return struct.pack("<H", number)


def u32(number):
    return struct.pack("<I", number)


class Mixed:
    def __init__(self):
        parser = argparse.ArgumentParser()
        parser.add_argument("--linegated", required=True)
        parser.add_argument("--linegate", required=True)
        parser.add_argument("--modules", required=True)
        self.programs = parser.parse_args()
        self.storage = os.path.join(FOLDER, "parameters")
        self.bus = Witness("vcan0")
        self.stranger = Stranger("vcan0", STRANGER, self.programs.modules)
        check("the stranger is ready", self.stranger.next_answer() == {"ready": True})
        self.device = self.simulate()

    def simulate(self):
        """The device with what it has stored; waits for its boot-up message."""
        so_far = len(self.bus.frames(0x700 + DEVICE))
        device = Actor(
            "device", self.programs.linegate, "simulate", "socketcan:vcan0",
            "--device", f"digital-io:{DEVICE}", "--store", self.storage,
        )  # fmt: skip
        eventually("the device booted", lambda: len(self.bus.frames(0x700 + DEVICE)) > so_far, 20)
        return device

    def power_cycle(self):
        self.device.kill()
        self.device = self.simulate()

    def start_gateway(self):
        plant = os.path.join(FOLDER, "mixed.yaml")
        with open(plant, "w", encoding="utf-8") as file:
            file.write(PLANT.format(node=STRANGER, eds=self.stranger.eds, storage=self.storage))
        self.gateway = Actor("linegated", self.programs.linegated, plant)

    def command(self, *arguments):
        return ask(self.programs.linegate, "--json", "--wait", "30", "--timeout", "20", *arguments, within=60)


def sent(mixed, identifier, data):
    """Waits until the witness has written down that frame."""
    frame = bytes.fromhex(data)
    eventually(
        f"the witness saw {identifier:X}#{data}",
        lambda: frame in [seen for _, _, seen in mixed.bus.frames(identifier)],
        10,
    )


def the_stranger_reads(mixed):
    upload = mixed.stranger.upload
    check("1000h is what the EDS says", upload(DEVICE, 0x1000, 0) == u32(0x00030191))
    check("1018h:1 and 2 are too", upload(DEVICE, 0x1018, 1) + upload(DEVICE, 0x1018, 2) == u32(0x4C47) + u32(0x401D))
    name = upload(DEVICE, 0x1008, 0)
    check(f"1008h is a name: {name}", isinstance(name, bytes) and len(name) > 4 and name.isascii())
    sent(mixed, 0x600 + DEVICE, "7000000000000000")  # it asked for a second segment
    said = upload(DEVICE, 0x2FFF, 0)
    check(f"an object that is not there is refused: {said}", isinstance(said, str))
    sent(mixed, 0x580 + DEVICE, "80ff2f0000000206")


def the_stranger_writes_and_stores(mixed):
    upload, download = mixed.stranger.upload, mixed.stranger.download
    check("it writes 1017h", download(DEVICE, 0x1017, 0, u16(250)) is None)
    check("and reads it back", upload(DEVICE, 0x1017, 0) == u16(250))
    said = download(DEVICE, 0x1010, 1, LOAD)
    check(f"1010h refuses another signature: {said}", said is not None)
    sent(mixed, 0x580 + DEVICE, "8010100120000008")
    check("it stores", download(DEVICE, 0x1010, 1, SAVE) is None)
    check("it writes again", download(DEVICE, 0x1017, 0, u16(300)) is None)
    mixed.power_cycle()
    check("after power-off 1017h is as stored", upload(DEVICE, 0x1017, 0) == u16(250))
    check("it restores the defaults", download(DEVICE, 0x1011, 1, LOAD) is None)
    mixed.power_cycle()
    check("after power-off 1017h is the default", upload(DEVICE, 0x1017, 0) == u16(0))


def the_line_has_a_stranger(mixed):
    mixed.start_gateway()

    def state():
        nodes = {node["node"]: node for node in mixed.command("nodes", "mixed")}
        return nodes.get(STRANGER, {}).get("state") == "operational"

    eventually("the line booted the stranger by the EDS that it wrote itself", state, 40)
    answer = mixed.command("sdo", "read", f"mixed:{STRANGER}", "1008", "0", "vs")
    check("its name is read in segments", bytes.fromhex(answer["data"]) == b"a device of the stranger")
    mixed.command("sdo", "write", f"mixed:{STRANGER}", "2000", "0", "u32", "0x12345678")
    answer = mixed.command("sdo", "read", f"mixed:{STRANGER}", "2000", "0", "u32")
    check("a number that was written is read", answer["data"] == "78563412")
    text = "a text that takes several segments"
    mixed.command("sdo", "write", f"mixed:{STRANGER}", "2001", "0", "vs", text)
    answer = mixed.command("sdo", "read", f"mixed:{STRANGER}", "2001", "0", "vs")
    check("and a text, in segments both ways", bytes.fromhex(answer["data"]).decode() == text)
    own = mixed.stranger.upload(OWN, 0x1000, 0)
    check("and the stranger reads 1000h of the line's own node", own == u32(0x195))


def the_line_stores_for_the_stranger(mixed):
    upload, download = mixed.stranger.upload, mixed.stranger.download
    check("it writes 1015h of the line's own node", download(OWN, 0x1015, 0, u16(7)) is None)
    check("and stores it", download(OWN, 0x1010, 1, SAVE) is None)
    mixed.gateway.kill()
    so_far = len(mixed.bus.frames(0x700 + OWN))
    mixed.start_gateway()
    eventually("another gateway runs the line", lambda: len(mixed.bus.frames(0x700 + OWN)) > so_far, 30)
    check("it has the 1015h that was stored", upload(OWN, 0x1015, 0) == u16(7))


def scenario():
    mixed = Mixed()
    the_stranger_reads(mixed)
    the_stranger_writes_and_stores(mixed)
    the_line_has_a_stranger(mixed)
    the_line_stores_for_the_stranger(mixed)
    check("the gateway ends well", mixed.gateway.stop() == 0)
    frames = mixed.bus.frames()
    wrong = malformed_frames(frames)
    check(f"tshark finds nothing malformed in {len(frames)} frames: {wrong[:5]}", wrong == [])


play(scenario)
