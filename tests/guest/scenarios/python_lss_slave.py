# SPDX-License-Identifier: Apache-2.0
"""An LSS slave (CiA 305) on python3-can that has no node-ID until one is assigned. Like some stacks, it continues to
answer fastscan in LSS configuration state."""

import struct
import threading

import can

from actors import Actor

MASTER, SLAVE = 0x7E5, 0x7E4
UNCONFIGURED = 255
SWITCH_GLOBAL, SELECT_FIRST, SELECT_LAST, SELECTED = 0x04, 0x40, 0x43, 0x44
SET_NODE, STORE, INQUIRE_FIRST, INQUIRE_LAST, INQUIRE_NODE = 0x11, 0x17, 0x5A, 0x5D, 0x5E
FASTSCAN, IDENTIFIED = 0x51, 0x4F


class PythonLssSlave:
    """A slave with this identity: vendor-ID, product code, revision number, serial number. It boots with the
    assigned node-ID at the next NMT reset communication or switch to waiting state."""

    def __init__(self, interface, identity):
        self.identity = identity
        self.name = f"lss-{identity[3]:X}"
        self.bus = can.Bus(interface="socketcan", channel=interface)
        self.node = self.pending = UNCONFIGURED
        self.is_configured = False  # LSS configuration state
        self.selected = []
        self.part = 0
        self.scans = 0
        self.listens = True
        threading.Thread(target=self.live, daemon=True).start()
        Actor.everyone.append(self)

    def send(self, identifier, data):
        self.bus.send(can.Message(arbitration_id=identifier, data=data, is_extended_id=False), timeout=5)

    def answer(self, *data):
        self.send(SLAVE, bytes(data).ljust(8, b"\0"))

    def live(self):
        while self.listens:
            message = self.bus.recv(timeout=0.05)
            if message is None or message.is_remote_frame:
                continue
            data = bytes(message.data)
            if message.arbitration_id == MASTER and len(data) == 8:
                self.hear(data)
            elif message.arbitration_id == 0x000 and len(data) == 2 and data[0] in (0x81, 0x82) and data[1] == 0:
                self.copy_values()
            elif message.arbitration_id == 0x600 + self.node and len(data) == 8:
                self.serve(data)

    def copy_values(self):
        """The pending node-ID becomes the active one."""
        self.is_configured = False
        if self.pending != UNCONFIGURED:
            self.node = self.pending
            self.send(0x700 + self.node, b"\0")

    def hear(self, data):
        command, number = data[0], struct.unpack("<I", data[1:5])[0]
        if command == SWITCH_GLOBAL:
            was_configured, self.is_configured = self.is_configured, data[1] == 1
            if was_configured and not self.is_configured and self.node == UNCONFIGURED:
                self.copy_values()
        elif SELECT_FIRST <= command <= SELECT_LAST:
            self.selected = (self.selected if command > SELECT_FIRST else []) + [number]
            if tuple(self.selected) == self.identity:
                self.is_configured = True
                self.answer(SELECTED)
        elif command == FASTSCAN:
            self.scan(number, *data[5:8])
        elif self.is_configured:
            self.configure(command, data)

    def configure(self, command, data):
        if command == SET_NODE:
            self.pending = data[1]
            self.answer(SET_NODE, 0)
        elif command == STORE:
            self.answer(STORE, 0)
        elif INQUIRE_FIRST <= command <= INQUIRE_LAST:
            self.answer(command, *struct.pack("<I", self.identity[command - INQUIRE_FIRST]))
        elif command == INQUIRE_NODE:
            self.answer(command, self.node)

    def scan(self, number, checked, sub, following):
        """Unlike CiA 305 requires, it also answers in configuration state."""
        if self.node != UNCONFIGURED:
            return
        self.scans += 1
        if checked == 0x80:
            self.part = 0
            self.answer(IDENTIFIED)
        elif sub == self.part and checked < 32 and (number ^ self.identity[sub]) >> checked == 0:
            self.answer(IDENTIFIED)
            if checked == 0 and number == self.identity[sub]:
                self.part = following
                self.is_configured = sub == 3 or self.is_configured

    def serve(self, data):
        """Answers expedited uploads of 1000h and 1018h, and aborts all other transfers."""
        index, sub = struct.unpack("<HB", data[1:4])
        value = {(0x1000, 0): 0x191, (0x1018, 0): 4, (0x1001, 0): 0}.get((index, sub))
        if index == 0x1018 and 1 <= sub <= 4:
            value = self.identity[sub - 1]
        if data[0] == 0x40 and value is not None:
            self.send(0x580 + self.node, bytes([0x43]) + data[1:4] + struct.pack("<I", value))
        else:
            self.send(0x580 + self.node, bytes([0x80]) + data[1:4] + struct.pack("<I", 0x06020000))

    # The interface of Actor.

    def text(self):
        return f"node {self.node}, asked by fastscan {self.scans} times"

    def runs(self):
        return self.listens

    def kill(self):
        self.listens = False
