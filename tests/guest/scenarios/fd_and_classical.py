#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Two lines of CANopen FD and two classical ones, joined by one gateway: boot, images, named types, SDO and USDO by
command; a routed SDO and a forwarded value from each kind of line to each; EMCYs in both directions. A classical SDO
client on one bus reads a device of CANopen FD on another, whose bus carries USDO and no SDO."""

import os
import socket
import struct

from actors import Actor, Failed, Site, Witness, check, eventually, play
from canopen_fd_bus import FRAME, FdWitness, make_interface, send_fd

EDS = os.path.abspath(os.path.join(os.path.dirname(__file__), "../../../bridges/sim/eds"))
OWN = 127
# Line: interface, network-ID, profile and node-ID of its device, of CANopen FD.
LINES = {
    "press": ("vcan1", 1, "fd-io", 5, True),
    "mill": ("fd1", 2, "fd-io", 6, True),
    "hall": ("vcan0", 3, "digital-io", 13, False),
    "pack": ("vcan2", 4, "digital-io", 22, False),
}
# The source counts, and the device of the target mirrors its output as an input.
RULES = [("press", "hall"), ("hall", "press"), ("press", "mill"), ("hall", "pack")]
NAMES = {"fd-io": "Linegate FD I/O", "digital-io": "Linegate digital I/O"}


def output_of(line):
    return "6200:2" if LINES[line][4] else "6200:1"


def plant():
    rules = "".join(f"  - {source}.io.6000:1 -> {target}.io.{output_of(target)}\n" for source, target in RULES)
    text = f"schema: 1\ngateway: {{name: guest}}\nforward:\n{rules}lines:\n"
    for line, (interface, network, profile, node, is_fd) in LINES.items():
        others = ", ".join(other for other in LINES if other != line)
        text += f"""\
  - name: {line}
    interface: socketcan:{interface}
    canopen_fd: {str(is_fd).lower()}
    emcy_fd: {str(line == "press").lower()}
    network_id: {network}
    access: all
    named: {{type_information: true}}
    enter: [{{from: [{others}], services: [sdo, emcy], access: all}}]
    emcy_to: [{others}]
    nodes:
      - {{id: {node}, name: io, eds: {EDS}/{profile}.eds, heartbeat: 500ms, pdos: {{rpdo1: {{map: ["{output_of(line)}"]}}}}}}
"""
    return text


class ClassicalClient:
    """Classical SDO with a network indication: stack/routing/README.md, definition A. Knows nothing of the code."""

    def __init__(self, interface):
        self.socket = socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW)
        self.socket.settimeout(60)
        self.socket.bind((interface,))

    def exchange(self, data):
        self.socket.send(FRAME.pack(0x600 + OWN, 8, data))
        while True:
            identifier, _, answer = FRAME.unpack(self.socket.recv(16))
            if identifier == 0x580 + OWN:
                return answer

    def enter(self, network, node):
        indication = struct.pack("<BHBB3x", 0xE0, network, node, 1)
        check(f"the gateway accepts node {node} of network {network}", self.exchange(indication) == indication)

    def read(self, network, node, index, sub):
        """Returns the value, or the abort code as an integer."""
        self.enter(network, node)
        answer = self.exchange(struct.pack("<BHB4x", 0x40, index, sub))
        if answer[0] == 0x80:
            return struct.unpack("<I", answer[4:])[0]
        if answer[0] & 0xE2 == 0x42:
            return answer[4 : 8 - (answer[0] >> 2 & 3)]
        value, toggle = b"", 0
        while True:
            segment = self.exchange(struct.pack("<B7x", 0x60 | toggle))
            if segment[0] & 0xE0 != 0:
                raise Failed(f"no segment: {segment.hex()}")
            value += segment[1 : 8 - (segment[0] >> 1 & 7)]
            toggle ^= 0x10
            if segment[0] & 1:
                return value

    def write(self, network, node, index, sub, value):
        """Segmented, whatever the length. Returns the last answer."""
        self.enter(network, node)
        self.exchange(struct.pack("<BHBI", 0x21, index, sub, len(value)))
        answer, toggle = b"", 0
        for at in range(0, len(value), 7):
            part = value[at : at + 7]
            last = at + 7 >= len(value)
            answer = self.exchange(bytes((toggle | (7 - len(part)) << 1 | last,)) + part.ljust(7, b"\0"))
            toggle ^= 0x10
        return answer


class Plant(Site):
    def __init__(self):
        super().__init__("reader", "profiles")
        make_interface("fd1")
        self.classical = {line: Witness(LINES[line][0]) for line in LINES}
        self.fd = {line: FdWitness(LINES[line][0]) for line in ("press", "mill")}
        for interface, _, profile, node, _ in LINES.values():
            Actor(f"device-{interface}", self.programs.linegate, "simulate", f"socketcan:{interface}", "--device",
                  f"{profile}:{node}")
        self.linegated = self.gateway("guest", plant())
        # It runs until its standard input ends.
        self.reader = Actor("reader", "bash", "-c", 'sleep infinity | "$@"', "reader", self.programs.reader, "0",
                            self.programs.profiles, "linegate")

    def operational(self, line):
        return any(node.get("state") == "operational" for node in self.command("nodes", line))

    def input(self, line, sub):
        """The value of an input byte in the image, or None if it is not valid."""
        for entry in self.command("image", line)["entries"]:
            if (entry["index"], entry["sub"]) == (0x6000, sub):
                return entry["value"]
        return None

    def name_of(self, line, via=None):
        _, network, _, node, _ = LINES[line]
        target = (f"{network}:{node}", "--via", via) if via else (f"{line}:{node}",)
        words = ("1008", "0", "vs") if via else ("1008", "0")
        return self.command("sdo", "read", *target, *words)["value"].strip('"')


def all_lines_run(site):
    for line in LINES:
        eventually(f"the device of {line} is operational", lambda line=line: site.operational(line))
    for line, (_, _, profile, _, is_fd) in LINES.items():
        check(f"sdo read on {line}", site.name_of(line) == NAMES[profile])
        count = len([one for one in site.command("image", line)["entries"] if one["index"] == 0x6000])
        check(f"the image of {line} has its inputs: {count}", count == (64 if is_fd else 4))
        eventually(f"{line} has named values", lambda line=line: f"plant/{line}/io/inputs" in site.reader.text())


def values_cross(site):
    for source, target in RULES:
        interface, _, _, node, _ = LINES[target]
        del interface
        seen = set()

        def changes(target=target, seen=seen):
            seen.add(site.input(target, 2))
            return len(seen - {None, 0}) >= 2

        eventually(f"the value of {source} arrives at {target}, and changes", changes)
        witness = site.fd[target] if LINES[target][4] else site.classical[target]
        sent = [frame[-1][:1] for frame in witness.frames(0x200 + node)]
        counted = [frame[-1][:1] for frame in
                   (site.fd[source] if LINES[source][4] else site.classical[source]).frames(0x180 + LINES[source][3])]
        check(f"each value that {target} receives is one of {source}", set(sent) - {b"\0"} <= set(counted))


def sdos_are_routed(site):
    for via in LINES:
        for line, (_, network, profile, node, _) in LINES.items():
            if via != line:
                check(f"sdo read from {via} to {line}", site.name_of(line, via) == NAMES[profile])
        other = next(line for line in LINES if line != via and LINES[line][4] == LINES[via][4])
        _, network, _, node, _ = LINES[other]
        site.command("sdo", "write", f"{network}:{node}", "1015", "0", "u16", "7", "--via", via)
        check(f"sdo write from {via} to {other}", site.command("sdo", "read", f"{other}:{node}", "1015", "0")["value"] in (7, "7"))
    refused = site.refused("sdo", "read", "1:5", "3000", "0", "u8", "--via", "hall")
    check(f"an abort of USDO has its words: {refused.strip()}", "object does not exist" in refused)


def a_classical_client_reaches_devices_of_canopen_fd(site):
    client = ClassicalClient("vcan0")
    for line in ("press", "mill"):
        _, network, profile, node, _ = LINES[line]
        check(f"expedited read on {line}", client.read(network, node, 0x1018, 2) == struct.pack("<I", 0x401F))
        check(f"segmented read on {line}", client.read(network, node, 0x1008, 0) == NAMES[profile].encode())
        check(f"the abort of {line}", client.read(network, node, 0x3333, 1) == 0x06020000)
        answer = client.write(network, node, 0x1015, 0, b"\x09\x00")
        check(f"segmented write on {line}", answer[0] & 0xE0 == 0x20)
        check("it has the value", client.read(network, node, 0x1015, 0) == b"\x09\x00")
        writes = [data for _, data in site.fd[line].frames(0x600 + OWN) if data[:2] == bytes((node, 0x01)) and
                  data[3:6] == b"\x00\x15\x10" and data[8:10] == b"\x09\x00"]
        check(f"one USDO download wrote it on {line}", len(writes) == 1)
        check(f"{line} carries no SDO", not site.classical[line].frames(0x600 + node))


def emcys_cross(site):
    send_fd("vcan1", 0x085, bytes.fromhex("1023 01 00 9101 01 00 000000000000 0102030405 00"))
    site.classical["hall"].await_frame(0x080 + OWN, bytes.fromhex("1023 01 0100 05 01") + numbered(site, "hall", 0x2310))
    Actor("cansend", "cansend", "vcan0", "08D#3081010102030405")
    eventually("an EMCY of the hall is on press", lambda: emcys(site, "press", 0x8130, LINES["hall"]))


def numbered(site, line, code):
    """The number in the forwarded EMCY, when it has arrived."""
    eventually(f"an EMCY of press is on {line}", lambda: emcys(site, line, code, LINES["press"]))
    return emcys(site, line, code, LINES["press"])[-1][-1:]


def emcys(site, line, code, source):
    wanted = struct.pack("<HBHBB", code, 1, source[1], source[3], 1)
    return [data for _, _, data in site.classical[line].frames(0x080 + OWN) if data[:7] == wanted]


def scenario():
    site = Plant()
    all_lines_run(site)
    values_cross(site)
    sdos_are_routed(site)
    a_classical_client_reaches_devices_of_canopen_fd(site)
    emcys_cross(site)
    routed = {one["line"]: one for one in site.command("routes")["lines"]}
    for line in LINES:
        check(f"nothing is left open on {line}", routed[line]["open"] == 0 and routed[line]["channels"] == 0)
    check("the gateway ends", site.linegated.stop() == 0)


play(scenario)
