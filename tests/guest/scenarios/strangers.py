#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Two foreign programs: a CANopen stack (npm's `canopen`), and a device and client in Python on python3-can. Both
are SDO clients of a simulated device and of a line's own node, and devices with an SDO server that the line boots
and the console reads and writes, one of them in blocks. Parameters that one of them stores in the device, or in that
node, survive a kill. The one in Python also has a heartbeat, node guarding, PDOs and EMCYs. At the end tshark's
CANopen dissector checks every frame."""

import json
import os
import struct

from actors import FOLDER, Actor, Site, Witness, check, eventually, play
from capture import nothing_is_malformed
from python_stranger import COMMANDED, NAME, TEXT, PythonStranger
from stranger import Stranger

DEVICE, OWN, STRANGER, PYTHON = 5, 127, 20, 21
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
      - {{id: {python}, name: python, eds: {python_eds}, heartbeat: 2s}}
"""


def u16(number):
    return struct.pack("<H", number)


def u32(number):
    return struct.pack("<I", number)


class Mixed(Site):
    def __init__(self):
        super().__init__("modules")
        self.storage = os.path.join(FOLDER, "parameters")
        self.bus = Witness("vcan0")
        self.stranger = Stranger("vcan0", STRANGER, self.programs.modules)
        check("the stranger is ready", self.stranger.next_answer() == {"ready": True})
        self.python = PythonStranger("vcan0", PYTHON)
        self.device = self.simulate()

    def simulate(self):
        """Starts the device with its stored parameters, and waits for its boot-up message."""
        so_far = self.bus.boot_ups(DEVICE)
        device = Actor(
            "device", self.programs.linegate, "simulate", "socketcan:vcan0",
            "--device", f"digital-io:{DEVICE}", "--store", self.storage,
        )  # fmt: skip
        eventually("the device booted", lambda: self.bus.boot_ups(DEVICE) > so_far)
        return device

    def power_cycle(self):
        self.device.kill()
        self.device = self.simulate()

    def start_gateway(self):
        """Starts the gateway, and waits for the boot-up message of its own node."""
        so_far = self.bus.boot_ups(OWN)
        self.linegated = self.gateway(
            "mixed",
            PLANT.format(
                node=STRANGER, eds=self.stranger.eds, python=PYTHON, python_eds=self.python.eds, storage=self.storage
            ),
        )
        eventually("the gateway runs the line", lambda: self.bus.boot_ups(OWN) > so_far)

    def node(self, number):
        """Returns the node as the console shows it."""
        return next((node for node in self.command("nodes", "mixed") if node["node"] == number), {})


def sent(mixed, identifier, data):
    mixed.bus.await_frame(identifier, bytes.fromhex(data))


def the_stranger_reads(mixed):
    upload = mixed.stranger.upload
    check("1000h is what the EDS says", upload(DEVICE, 0x1000, 0) == u32(0x00030191))
    check("1018h:1 and 2 are too", upload(DEVICE, 0x1018, 1) + upload(DEVICE, 0x1018, 2) == u32(0x4C47) + u32(0x401D))
    name = upload(DEVICE, 0x1008, 0)
    check(f"1008h is a name: {name}", isinstance(name, bytes) and len(name) > 4 and name.isascii())
    sent(mixed, 0x600 + DEVICE, "7000000000000000")  # a request of a second segment
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
    eventually(
        "the line booted the stranger by the EDS that it wrote itself",
        lambda: mixed.node(STRANGER).get("state") == "operational",
    )
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
    mixed.linegated.kill()
    mixed.start_gateway()
    check("another gateway has the 1015h that was stored", upload(OWN, 0x1015, 0) == u16(7))


def python_asks_a_device(mixed):
    client = mixed.python.client(DEVICE)
    name = mixed.stranger.upload(DEVICE, 0x1008, 0)
    check("to the one in Python 1000h is the same", client.upload(0x1000, 0) == u32(0x00030191))
    check("its name is, in segments", client.upload(0x1008, 0) == name)
    check("and in blocks, three segments each", client.block_upload(0x1008, 0, size=3) == name)
    check("a write in segments of what is too long is refused", client.download(0x1017, 0, bytes(9)) == 0x06070012)
    check("what is not there is refused in blocks, too", client.block_upload(0x2FFF, 0) == 0x06020000)
    check("it writes 1015h in a block", client.block_download(0x1015, 0, u16(77)) is None)
    check("and reads it back", client.upload(0x1015, 0) == u16(77))
    guards = mixed.bus.frames(0x700 + DEVICE)
    for _ in range(2):
        mixed.python.send(0x700 + DEVICE, b"", remote=True)
    eventually("its guard requests are answered", lambda: len(mixed.bus.frames(0x700 + DEVICE)) >= len(guards) + 2)
    toggles = [data[0] for _, _, data in mixed.bus.frames(0x700 + DEVICE) if len(data) == 1][-2:]
    check(f"with a toggle bit: {toggles}", toggles == [0x7F, 0xFF])


def the_line_has_python(mixed):
    python, place = mixed.python, f"mixed:{PYTHON}"
    eventually(
        "the line booted the one in Python by a sloppy EDS", lambda: mixed.node(PYTHON).get("state") == "operational"
    )
    check("and gave it a heartbeat", python.server.objects[(0x1017, 0)] == u16(2000))
    answer = mixed.command("sdo", "read", place, "1008", "0", "vs")
    check("its name is read in segments", bytes.fromhex(answer["data"]) == NAME)
    text = "a text that goes in blocks, " * 10
    mixed.command("sdo", "write", place, "2001", "0", "vs", text)
    check("a long text came in blocks", python.server.objects[TEXT] == text.encode())
    answer = mixed.command("sdo", "read", place, "2001", "0", "vs")
    check("and is read back", bytes.fromhex(answer["data"]).decode() == text)
    wanted = {"expedited upload", "expedited download", "segmented upload", "block download", "block upload"}
    check(f"transfers of every kind: {sorted(python.server.seen)}", python.server.seen >= wanted)
    client = python.client(OWN)
    check("it reads 1018h:0 of the line's own node", client.upload(0x1018, 0) == b"\x04")
    check("and writes its 1015h in a block", client.block_download(0x1015, 0, u16(9)) is None)


def pdos_and_errors_of_python(mixed):
    python = mixed.python

    def value():
        python.send_pdo(0x01020304)  # like its event timer
        images = mixed.command("image", "mixed")
        return "16909060" in json.dumps(images)

    eventually("its TPDO is in the image", value)
    mixed.command("write", "mixed", f"{PYTHON}.2002:0", "4711")
    eventually("an output reaches its RPDO", lambda: python.server.objects[COMMANDED] == u32(4711))
    python.send_emcy(0x2310, 0x03)
    eventually("its EMCY is reported", lambda: mixed.node(PYTHON).get("last_emcy") == 0x2310)
    python.send_emcy(0, 0)
    python.power_off()
    eventually("without its heartbeat it is missing", lambda: mixed.node(PYTHON).get("presence") == "missing")
    python.power_on()
    eventually("and it is booted again", lambda: mixed.node(PYTHON).get("state") == "operational")


def scenario():
    mixed = Mixed()
    the_stranger_reads(mixed)
    python_asks_a_device(mixed)
    the_stranger_writes_and_stores(mixed)
    the_line_has_a_stranger(mixed)
    the_line_has_python(mixed)
    pdos_and_errors_of_python(mixed)
    the_line_stores_for_the_stranger(mixed)
    check("the gateway ends well", mixed.linegated.stop() == 0)
    nothing_is_malformed(mixed.bus.frames())


play(scenario)
