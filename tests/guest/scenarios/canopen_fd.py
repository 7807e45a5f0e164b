#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Two lines of CANopen FD on interfaces with CAN FD: PDOs of 64 bytes on the bus, byte for byte, also under a load of FD
frames of another origin, and a client of its own that reads and writes by USDO. A third interface has no CAN FD: its line
reports that."""

import os
import struct

from actors import Actor, Site, check, eventually, play, send
from canopen_fd_bus import FD_FRAME, FdWitness, fd_frame, fd_socket, make_interface

EDS = os.path.abspath(os.path.join(os.path.dirname(__file__), "../../../bridges/sim/eds/fd-io.eds"))
NODE = 5
DEFAULTS = ", ".join(f"'io.6200:{byte:X}': {byte}" for byte in range(1, 64))
PLANT = """\
schema: 1
gateway: {{name: guest}}
lines:
  - name: press
    interface: socketcan:vcan1
    canopen_fd: true
    access: all
    nodes: [{{id: 5, name: io, eds: {eds}, heartbeat: 500ms}}]
    outputs: {{defaults: {{{defaults}}}}}
  - name: hall
    interface: socketcan:fd1
    canopen_fd: true
    usdo_abort: four-bytes
    access: all
    nodes: [{{id: 5, name: io, eds: {eds}, heartbeat: 500ms}}]
  - name: old
    interface: socketcan:vcan0
    canopen_fd: true
    nodes: [{{id: 5, name: io, eds: {eds}}}]
"""


class UsdoClient:
    """Frames by the table of CiA 1301 as SOFA-CANopenFD publishes it; knows nothing of the code of Linegate."""

    def __init__(self, interface, node):
        self.node = node
        self.session = 0
        self.socket = fd_socket(interface)

    def exchange(self, server, command, index, sub, more=b""):
        """Returns the answer: command, sub-index, index, rest."""
        self.session += 1
        data = bytes((server, command, self.session, sub)) + struct.pack("<H", index) + more
        self.socket.send(fd_frame(0x600 + self.node, data))
        while True:
            received = self.socket.recv(72)
            if len(received) != 72:
                continue
            identifier, length, _, data = FD_FRAME.unpack(received)
            if identifier == 0x580 + server and data[0] == self.node and data[2] == self.session:
                return data[1], data[3], struct.unpack("<H", data[4:6])[0], data[6:length]

    def read(self, server, index, sub):
        return self.exchange(server, 0x11, index, sub)

    def write(self, server, index, sub, data_type, value):
        return self.exchange(server, 0x01, index, sub, bytes((data_type, len(value))) + value)


class Bus(Site):
    def __init__(self):
        super().__init__()
        make_interface("fd1")
        self.press, self.hall = FdWitness("vcan1"), FdWitness("fd1")
        for interface in ("vcan1", "fd1"):
            Actor(f"device-{interface}", self.programs.linegate, "simulate", f"socketcan:{interface}", "--device", f"fd-io:{NODE}")
        self.linegated = self.gateway("guest", PLANT.format(eds=EDS, defaults=DEFAULTS))

    def operational(self, line):
        return any(node["node"] == NODE and node.get("state") == "operational" for node in self.command("nodes", line))

    def counters(self, line):
        lines = self.command("monitor", "--once")["lines"]
        return next(one["counters"] for one in lines if one["line"] == line)


def pdos_of_64_bytes_cross(bus):
    bus.command("write", "press", "io.6200:40", "0x99")
    wanted = bytes(range(1, 64)) + b"\x99"
    eventually("the RPDO has all 64 bytes", lambda: wanted in [data for _, data in bus.press.frames(0x205)])
    flags = {flags for flags, _ in bus.press.frames(0x205)}
    check(f"it has the bit rate switched: flags {flags}", all(flag & 1 for flag in flags))
    eventually("the device sends as many back", lambda: wanted[1:] in [data[1:] for _, data in bus.press.frames(0x185)])
    entries = bus.command("image", "press")["entries"]
    check("the image has them", [one["value"] for one in entries if one["sub"] == 64] == [0x99])


def a_client_of_its_own_uses_usdo(bus):
    client = UsdoClient("vcan1", 3)
    command, sub, index, rest = client.read(NODE, 0x1018, 2)
    check("the device answers an upload", (command, sub, index) == (0x31, 2, 0x1018) and rest[:2] == b"\x07\x04")
    check("with its product code", struct.unpack("<I", rest[2:6])[0] == 0x401F)
    check("and a download", client.write(NODE, 0x1017, 0, 0x06, b"\xf4\x01")[0] == 0x21)
    command, sub, index, rest = client.read(NODE, 0x3333, 1)
    check("an abort of one byte", (command, sub, index, rest[0]) == (0x7F, 1, 0x3333, 0x33))
    check("the gateway's own node answers, too", client.read(127, 0x1000, 0)[0] == 0x31)
    hall = UsdoClient("fd1", 3)
    command, _, _, rest = hall.read(127, 0x3333, 1)
    check("four-bytes: 80h with the code of SDO", (command, rest[:4]) == (0x80, struct.pack("<I", 0x06020000)))


def a_load_of_fd_frames_disturbs_nothing(bus):
    before = bus.counters("press")
    load = Actor("cangen", "cangen", "vcan1", "-f", "-b", "-g", "2", "-I", "7E0", "-L", "64", "-n", "1000")
    for value in range(1, 6):
        bus.command("write", "press", "io.6200:40", str(value))
        wanted = bytes(range(1, 64)) + bytes((value,))
        eventually(f"value {value} crosses", lambda wanted=wanted: wanted in [data for _, data in bus.press.frames(0x205)])
    eventually("the load has ended", lambda: not load.runs())
    after = bus.counters("press")
    check("its frames are counted", after["fd_frames_received"] - before["fd_frames_received"] >= 1000)
    check("none is lost or malformed", (after["frames_lost"], after["frames_malformed"]) == (0, 0))
    check("the node is still operational", bus.operational("press"))


def an_interface_without_can_fd_is_reported(bus):
    eventually("it is reported", lambda: "CAN FD" in bus.linegated.text())
    send("vcan0", "705#05")
    lines = bus.command("monitor", "--once")["lines"]
    check("nothing is sent there", next(one["counters"] for one in lines if one["line"] == "old")["frames_sent"] == 0)


def scenario():
    bus = Bus()
    for line in ("press", "hall"):
        eventually(f"the node of {line} is operational", lambda line=line: bus.operational(line))
    pdos_of_64_bytes_cross(bus)
    a_client_of_its_own_uses_usdo(bus)
    a_load_of_fd_frames_disturbs_nothing(bus)
    an_interface_without_can_fd_is_reported(bus)
    check("the gateway ends", bus.linegated.stop() == 0)


play(scenario)
