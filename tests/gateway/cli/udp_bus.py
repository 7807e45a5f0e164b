# SPDX-License-Identifier: Apache-2.0
"""A bus of the interface udp: with the view of a CANopen tool: NMT states of its nodes, and expedited SDOs.

Frames are datagrams in the format of python-can's udp_multicast. The required part of msgpack is implemented here,
so that a test of the tier dds needs no package.
"""

import socket
import struct
import threading
import time

OPERATIONAL = 5


def packed(identifier, data):
    def text(word):
        return bytes([0xA0 | len(word)]) + word.encode()

    flags = b"".join(text(name) + b"\xc2" for name in ("is_extended_id", "is_remote_frame", "is_error_frame", "is_fd"))
    return (bytes([0x87]) + text("arbitration_id") + b"\xce" + struct.pack(">I", identifier) + flags +
            text("dlc") + bytes([len(data)]) + text("data") + bytes([0xC4, len(data)]) + bytes(data))


def unpacked(datagram):
    """Returns (identifier, data) of a frame, or None for any other datagram."""
    sizes = {0xCA: 4, 0xCB: 8, 0xCC: 1, 0xCD: 2, 0xCE: 4, 0xCF: 8, 0xD0: 1, 0xD1: 2, 0xD2: 4, 0xD3: 8}
    at = 1

    def value():
        nonlocal at
        kind, at = datagram[at], at + 1
        if kind < 0x80:
            return kind
        if 0xA0 <= kind < 0xC0 or kind in (0xC4, 0xD9):
            size = kind & 0x1F if kind < 0xC0 else datagram[at]
            begin = at if kind < 0xC0 else at + 1
            at = begin + size
            return bytes(datagram[begin:at])
        if kind in sizes:
            begin, at = at, at + sizes[kind]
            return int.from_bytes(datagram[begin:at], "big")
        return kind == 0xC3

    try:
        fields = {}
        for _ in range(datagram[0] & 0x0F):
            key = value()
            fields[key] = value()
        return fields[b"arbitration_id"], fields.get(b"data") or b""
    except (IndexError, KeyError):
        return None


class Bus:
    def __init__(self, group, port):
        self.address = (group, port)
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 20)
        self.socket.bind(self.address)
        membership = struct.pack("=4s4s", socket.inet_aton(group), socket.inet_aton("127.0.0.1"))
        self.socket.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, membership)
        self.socket.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, socket.inet_aton("127.0.0.1"))
        self.news = threading.Condition()
        self.states = {}  # by node-ID, received since forget()
        self.booted = set()
        self.answers = []
        threading.Thread(target=self.listen, daemon=True).start()

    def listen(self):
        while True:
            frame = unpacked(self.socket.recv(2048))
            if frame is None:
                continue
            identifier, data = frame
            with self.news:
                if 0x701 <= identifier <= 0x77F and len(data) == 1:
                    self.states[identifier - 0x700] = data[0] & 0x7F
                    if data[0] == 0:
                        self.booted.add(identifier - 0x700)
                elif 0x581 <= identifier <= 0x5FF and len(data) == 8:
                    self.answers.append((identifier - 0x580, data))
                self.news.notify_all()

    def forget(self):
        with self.news:
            self.states.clear()
            self.booted.clear()

    def send(self, identifier, data):
        self.socket.sendto(packed(identifier, data), self.address)

    def operational(self, nodes, patience):
        """Whether all of them boot and become Operational within `patience`."""
        with self.news:
            return self.news.wait_for(
                lambda: all(node in self.booted and self.states[node] == OPERATIONAL for node in nodes), patience)

    def ask(self, node, request, patience):
        """Returns the answer of a node's default SDO server."""
        def answer():
            mine = [data for sender, data in self.answers if sender == node and data[1:4] == request[1:4]]
            return mine[0] if mine else None

        with self.news:
            self.answers.clear()
        self.send(0x600 + node, request)
        with self.news:
            self.news.wait_for(answer, patience)
            return answer()

    def read(self, node, index, sub, patience=5):
        answer = self.ask(node, struct.pack("<BHBI", 0x40, index, sub, 0), patience)
        if answer is None or answer[0] & 0xE3 != 0x43:
            return None
        size = 4 - ((answer[0] >> 2) & 3)
        return int.from_bytes(answer[4:4 + size], "little")

    @staticmethod
    def download(index, sub, value, size):
        return struct.pack("<BHBI", 0x23 | (4 - size) << 2, index, sub, value)

    def write(self, node, index, sub, value, size, patience=5):
        answer = self.ask(node, self.download(index, sub, value, size), patience)
        return answer is not None and answer[0] == 0x60

    def begin_save(self, node):
        """Writes 1010h:1 without waiting for the answer."""
        self.send(0x600 + node, self.download(0x1010, 1, int.from_bytes(b"save", "little"), 4))


def pause(seconds):
    time.sleep(max(0.0, seconds))
