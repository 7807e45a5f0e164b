# SPDX-License-Identifier: Apache-2.0
"""A CAN controller whose errors the test determines: a serial adapter for the kernel's driver slcan on a
pseudo-terminal, simulated here, and the bus behind it, which is a vcan interface. For the protocol of such an
adapter see linux/drivers/net/can/slcan."""

import fcntl
import os
import select
import socket
import struct
import subprocess
import threading
import tty

from actors import eventually

SLCAN_DISCIPLINE = 17
TIOCSETD, SIOCGIFNAME = 0x5423, 0x8910
FRAME = struct.Struct("=IB3x8s")
WARNING, PASSIVE, OFF = 96, 128, 256
TRANSMIT_ERROR = 8  # increment of the TEC for each transmit error (ISO 11898-1)


class SerialController:
    """Its transmit error counter rises and falls as in ISO 11898-1, between the bounds that the test sets; its
    reports follow from the counter."""

    def __init__(self, name, bus, bit_rate=None):
        """bit_rate: set for the interface, which stays down."""
        self.name = name
        self.commands = []  # commands from the driver: "S6", "O", "C", ...
        self.others = None  # controllers that may acknowledge its frames; None: each is acknowledged
        self._is_open = False
        self._listens = False
        self._errors = None  # the letter of an error, while each frame causes one
        self._highest = OFF
        self._counter = 0
        self._lock = threading.Lock()
        self._near, self._far = os.openpty()
        for end in (self._near, self._far):
            tty.setraw(end)
        self._bus = socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW)
        self._bus.bind((bus,))
        fcntl.ioctl(self._far, TIOCSETD, struct.pack("i", SLCAN_DISCIPLINE))
        given = fcntl.ioctl(self._far, SIOCGIFNAME, bytes(32))[:16].split(b"\0")[0].decode()
        # Setting the interface up blocks until its commands have been read.
        threading.Thread(target=self._play, daemon=True).start()
        subprocess.run(["ip", "link", "set", given, "name", name], check=True)
        if bit_rate is not None:
            subprocess.run(["ip", "link", "set", name, "type", "can", "bitrate", str(bit_rate)], check=True)

    # --- calls of a test ---

    def disturb(self, error, highest):
        """From now on each frame it sends causes this error, until its TEC is `highest`: "a" no acknowledge, "b" a
        bit that differs on the bus."""
        with self._lock:
            self._errors, self._highest = error, highest

    def repair(self):
        with self._lock:
            self._errors = None

    def acknowledges(self):
        """Whether it acknowledges the frames of other controllers."""
        return self._is_open and not self._listens and self._counter < OFF

    # --- the adapter ---

    def _play(self):
        text = b""
        while True:
            for ready in select.select([self._near, self._bus], [], [])[0]:
                if ready is self._bus:
                    self._from_bus(self._bus.recv(FRAME.size))
                else:
                    text += os.read(self._near, 4096)
                    *words, text = text.split(b"\r")
                    for word in words:
                        with self._lock:
                            self._from_host(word.decode())

    def _say(self, word):
        os.write(self._near, word.encode() + b"\r")

    def _from_bus(self, raw):
        identifier, length, data = FRAME.unpack(raw)
        with self._lock:
            if self._is_open and self._counter < OFF and self._errors is None and identifier < 0x800:
                self._say(f"t{identifier:03X}{length}{data[:length].hex().upper()}")

    def _from_host(self, word):
        if word[:1] == "t":
            self._send(int(word[1:4], 16), bytes.fromhex(word[5:]))
            return
        self.commands.append(word)
        if word in ("O", "L", "C"):
            self._is_open = word != "C"
            self._listens = word == "L"
            self._counter = 0

    def _send(self, identifier, data):
        if not self.acknowledges():
            return
        before = self._counter
        if self._errors is None and not self._is_acknowledged():
            self._say("e1a")
            self._counter = min(before + TRANSMIT_ERROR, PASSIVE)
        elif self._errors is None:
            self._counter = max(0, before - 1)
            self._bus.send(FRAME.pack(identifier, len(data), data))
        elif before + TRANSMIT_ERROR <= self._highest:
            self._say(f"e1{self._errors}")
            self._counter = before + TRANSMIT_ERROR
        self._tell_state(before)

    def _is_acknowledged(self):
        return self.others is None or any(other.acknowledges() for other in self.others)

    def _tell_state(self, before):
        if state(self._counter) != state(before):
            self._say(f"s{state(self._counter)}000{min(self._counter, 255):03}")


def state(counter):
    return "b" if counter >= OFF else "p" if counter >= PASSIVE else "w" if counter >= WARNING else "a"


def restart(controller):
    """Restarts a controller like an operator whose driver has no restart."""
    for way in ("down", "up"):
        subprocess.run(["ip", "link", "set", controller.name, way], check=True)
    eventually(f"{controller.name} is open again", lambda: controller.commands[-1] in ("O", "L"), 10)
