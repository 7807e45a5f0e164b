# SPDX-License-Identifier: Apache-2.0
"""Interfaces with CAN FD, frames on them, and a witness of these frames."""

import re
import socket
import struct
import subprocess

from actors import Actor, eventually, read

MTU_FD = "72"
FRAME = struct.Struct("=IB3x8s")  # classical
FD_FRAME = struct.Struct("=IBB2x64s")
FD_FLAG, BIT_RATE_SWITCH = 0x04, 0x01
LENGTHS = (0, 1, 2, 3, 4, 5, 6, 7, 8, 12, 16, 20, 24, 32, 48, 64)


def make_interface(name):
    for command in (f"ip link add {name} type vcan", f"ip link set {name} mtu {MTU_FD}", f"ip link set {name} up"):
        subprocess.run(command.split(), check=True)


def fd_socket(interface):
    out = socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW)
    out.setsockopt(socket.SOL_CAN_RAW, socket.CAN_RAW_FD_FRAMES, 1)
    out.settimeout(60)
    out.bind((interface,))
    return out


def fd_frame(identifier, data):
    """The frame, padded to the next length of CAN FD."""
    length = next(size for size in LENGTHS if size >= len(data))
    return FD_FRAME.pack(identifier, length, FD_FLAG | BIT_RATE_SWITCH, data)


def send_fd(interface, identifier, data):
    fd_socket(interface).send(fd_frame(identifier, data))


class FdWitness(Actor):
    """candump on one interface: frames of CAN FD."""

    LINE = re.compile(r"\([0-9.]+\) \S+ ([0-9A-F]+)##([0-9A-F])([0-9A-F]*)$")

    def __init__(self, interface):
        super().__init__(f"candump-{interface}", "candump", "-L", interface)
        eventually(f"a witness on {interface}", lambda: f"{interface} " in read("/proc/net/can/rcvlist_all"))

    def frames(self, identifier):
        """Returns [(flags, data)] so far."""
        found = []
        for line in self.text().splitlines():
            match = self.LINE.match(line)
            if match and int(match[1], 16) == identifier:
                found.append((int(match[2], 16), bytes.fromhex(match[3])))
        return found
