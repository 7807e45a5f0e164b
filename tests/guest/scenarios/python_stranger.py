# SPDX-License-Identifier: Apache-2.0
"""A CANopen device and SDO client on python3-can, with the SDO of stranger_sdo.py."""

import os
import queue
import struct
import threading
import time

import can

from actors import FOLDER, PATIENCE, Actor, Failed
from stranger_sdo import SdoClient, SdoServer, aborted

PRE_OPERATIONAL, OPERATIONAL, STOPPED = 0x7F, 0x05, 0x04
STATES = {0x01: OPERATIONAL, 0x02: STOPPED, 0x80: PRE_OPERATIONAL}
NUMBER, TEXT, COMMANDED = (0x2000, 0), (0x2001, 0), (0x2002, 0)
U8, U16, U32, STRING = 5, 6, 7, 9
NAME = b"a device of Python"

# index, sub or None, name, type, access, value, mapped?
EDS_OBJECTS = [
    (0x1000, None, "Device type", U32, "ro", "0x00030191", 0),
    (0x1001, None, "Error register", U8, "ro", "0", 0),
    (0x1008, None, "Device name", STRING, "const", NAME.decode(), 0),
    (0x1017, None, "Producer heartbeat time", U16, "rw", "0", 0),
    (0x1018, 0, "Highest sub-index", U8, "const", "2", 0),
    (0x1018, 1, "Vendor-ID", U32, "ro", "0x61", 0),
    (0x1018, 2, "Product code", U32, "ro", "0x62", 0),
    (0x1400, 0, "Highest sub-index", U8, "const", "2", 0),
    (0x1400, 1, "COB-ID", U32, "ro", "$NODEID+0x200", 0),
    (0x1400, 2, "Transmission type", U8, "ro", "255", 0),
    (0x1600, 0, "Entries", U8, "ro", "1", 0),
    (0x1600, 1, "Entry", U32, "ro", "0x20020020", 0),
    (0x1800, 0, "Highest sub-index", U8, "const", "2", 0),
    (0x1800, 1, "COB-ID", U32, "ro", "$NODEID+0x40000180", 0),
    (0x1800, 2, "Transmission type", U8, "ro", "255", 0),
    (0x1A00, 0, "Entries", U8, "ro", "1", 0),
    (0x1A00, 1, "Entry", U32, "ro", "0x20000020", 0),
    (0x2000, None, "Number", U32, "rwr", "0", 1),
    (0x2001, None, "Text", STRING, "rw", "text", 0),
    (0x2002, None, "Commanded", U32, "rww", "0", 1),
]


def eds_text():
    """Returns its EDS, with typical irregularities: CR LF, and indices that are not in order."""
    lines = ["[FileInfo]", "EDSVersion=4.0", "[DeviceInfo]", "VendorName=A stranger", "Granularity=0"]
    lines += ["[MandatoryObjects]", "SupportedObjects=3", "1=0x1018", "2=0x1000", "3=0x1001"]
    others = sorted({row[0] for row in EDS_OBJECTS} - {0x1000, 0x1001, 0x1018})
    for section, first, last in (("Optional", 0x1002, 0x1FFF), ("Manufacturer", 0x2000, 0x5FFF)):
        listed = [index for index in others if first <= index <= last]
        lines += [f"[{section}Objects]", f"SupportedObjects={len(listed)}"]
        lines += [f"{n}=0x{index:04X}" for n, index in enumerate(listed, 1)]
    for index, sub, name, kind, access, value, mapped in EDS_OBJECTS:
        if sub == 0:
            count = sum(row[0] == index for row in EDS_OBJECTS)
            lines += [f"[{index:04X}]", f"ParameterName={name}", "ObjectType=9", f"SubNumber={count}"]
        lines += [f"[{index:04X}]" if sub is None else f"[{index:04X}sub{sub}]", f"ParameterName={name}"]
        lines += ["ObjectType=7", f"DataType={kind}", f"AccessType={access}", f"DefaultValue={value}"]
        lines += [f"PDOMapping={mapped}"]
    return "\r\n".join(lines) + "\r\n"


class PythonStranger:
    def __init__(self, interface, node):
        self.node = node
        self.name = f"python-{node}"
        self.eds = os.path.join(FOLDER, f"{self.name}.eds")
        with open(self.eds, "w", encoding="ascii", newline="") as file:
            file.write(eds_text())
        self.bus = can.Bus(interface="socketcan", channel=interface)
        self.answers = queue.Queue()
        self.alive = False
        self.listens = True
        self.power_on()
        threading.Thread(target=self.live, daemon=True).start()
        Actor.everyone.append(self)

    def power_on(self):
        values = {(row[0], row[1] or 0): self.value(row) for row in EDS_OBJECTS}
        self.server = SdoServer(values, {(0x1017, 0), NUMBER, TEXT, COMMANDED})
        self.alive = True  # requests follow as soon as its boot-up message is received
        self.boot()

    def value(self, row):
        if row[3] == STRING:
            return row[5].encode()
        number = int(row[5].replace("$NODEID+", ""), 0) + (self.node if "$" in row[5] else 0)
        return number.to_bytes({U8: 1, U16: 2, U32: 4}[row[3]], "little")

    def boot(self):
        self.state = PRE_OPERATIONAL
        self.toggle = 0
        self.next_heartbeat = 0
        self.send(0x700 + self.node, b"\0")

    def power_off(self):
        self.alive = False

    def send(self, identifier, data, remote=False):
        message = can.Message(arbitration_id=identifier, data=data, is_extended_id=False, is_remote_frame=remote)
        self.bus.send(message, timeout=5)

    def live(self):
        while self.listens:
            message = self.bus.recv(timeout=0.05)
            if message is not None and 0x581 <= message.arbitration_id <= 0x5FF:
                self.answers.put((message.arbitration_id - 0x580, message.timestamp, bytes(message.data)))
            if not self.alive:
                continue
            if message is not None:
                self.hear(message)
            period = struct.unpack("<H", self.server.objects[(0x1017, 0)])[0] / 1000
            if period and time.monotonic() >= self.next_heartbeat:
                self.next_heartbeat = time.monotonic() + period
                self.send(0x700 + self.node, bytes([self.state]))

    def hear(self, message):
        identifier, data = message.arbitration_id, bytes(message.data)
        if identifier == 0x700 + self.node and message.is_remote_frame:
            self.send(identifier, bytes([self.state | self.toggle]))
            self.toggle ^= 0x80
        elif identifier == 0x000 and len(data) == 2 and data[1] in (0, self.node):
            if data[0] in (0x81, 0x82):
                self.boot()
            else:
                self.state = STATES.get(data[0], self.state)
        elif identifier == 0x600 + self.node and len(data) == 8 and self.state != STOPPED:
            for answer in self.server.take(data):
                self.send(0x580 + self.node, answer)
        elif identifier == 0x200 + self.node and len(data) >= 4 and self.state == OPERATIONAL:
            self.server.objects[COMMANDED] = data[:4]

    # Frames that it sends without a request.

    def send_pdo(self, number):
        self.server.objects[NUMBER] = struct.pack("<I", number)
        self.send(0x180 + self.node, self.server.objects[NUMBER])

    def send_emcy(self, code, register, info=b""):
        self.send(0x080 + self.node, struct.pack("<HB", code, register) + info.ljust(5, b"\0"))

    def client(self, server):
        """Returns an SDO client of that server."""

        begin = 0.0  # start of the transfer, by the clock of the kernel's stamps

        def ask(frame, answered=True, first=False):
            nonlocal begin
            if first:
                begin = time.time()
            if frame is not None:
                self.send(0x600 + server, frame)
            while answered:
                try:
                    sender, stamp, data = self.answers.get(timeout=PATIENCE)
                except queue.Empty:
                    self.send(0x600 + server, aborted(b"\0\0\0", 0x05040000))
                    raise Failed(f"{server} does not answer to the stranger in Python") from None
                if sender == server and stamp >= begin:
                    return data
            return None

        return SdoClient(ask)

    # The interface of Actor.

    def text(self):
        return f"state {self.state:02X}, transfers: {sorted(self.server.seen)}"

    def runs(self):
        return self.listens

    def kill(self):
        self.listens = False
