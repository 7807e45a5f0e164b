#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""A foreign PLC (npm's `canopen`) is the master of a device of a line: it reads and configures the device by SDO,
starts and stops it, exchanges PDOs with it, and receives its heartbeat and its EMCYs; parameters that it stores in
the device survive a kill of the gateway. At the end tshark's CANopen dissector checks every frame."""

import os
import struct

from actors import FOLDER, Site, Witness, check, eventually, play
from capture import nothing_is_malformed
from stranger import Stranger

DEVICE, MASTER = 5, 100
INPUT = "panel.Read input 8-bit.Inputs 1"
SAVE = b"save"
PRE_OPERATIONAL, OPERATIONAL, STOPPED = 127, 5, 4
PLANT = """\
schema: 1
gateway: {{name: guest}}
lines:
  - name: plc
    interface: socketcan:vcan0
    bit_rate: 500kbit
    role: device
    access: all
    storage: {storage}
    devices: [{{id: 5, name: panel, profile: 401, digital_inputs: 1, digital_outputs: 1}}]
"""


def u16(number):
    return struct.pack("<H", number)


class Plant(Site):
    def __init__(self):
        super().__init__("modules")
        self.bus = Witness("vcan0")
        self.plc = Stranger("vcan0", MASTER, self.programs.modules, "plc")
        check("the PLC is ready", self.plc.next_answer() == {"ready": True})
        self.start()

    def start(self):
        """Starts the gateway, and waits for the boot-up message of its device."""
        booted = self.bus.boot_ups(DEVICE)
        self.linegated = self.gateway("below", PLANT.format(storage=os.path.join(FOLDER, "parameters")))
        eventually("the device booted", lambda: self.bus.boot_ups(DEVICE) > booted)

    def state(self):
        return next((node["state"] for node in self.command("nodes", "plc") if node["node"] == DEVICE), None)

    def entry(self, index, *options):
        """Returns (value, valid) of the first entry of that object in the image."""
        entries = self.command("image", *options, "plc")["entries"] or []
        return next(((entry["value"], entry["valid"]) for entry in entries if entry["index"] == index), (None, None))


def the_plc_configures_the_device(plant):
    upload, download = plant.plc.upload, plant.plc.download
    check("1000h: digital inputs and outputs of CiA 401", upload(DEVICE, 0x1000, 0) == struct.pack("<I", 0x00030191))
    check("1008h is its name, in segments", upload(DEVICE, 0x1008, 0) == b"panel")
    said = download(DEVICE, 0x6000, 1, b"\x01")
    check(f"an input is not written: {said}", said is not None)
    check("it gets a heartbeat", download(DEVICE, 0x1017, 0, u16(250)) is None)
    eventually("and is heard: pre-operational", lambda: plant.plc.last("state") == PRE_OPERATIONAL)


def they_exchange_pdos(plant):
    plc = plant.plc
    plc.nmt("startNode")  # the PLC itself
    plc.nmt("startNode", DEVICE)
    eventually("the PLC hears it: operational", lambda: plc.last("state") == OPERATIONAL)
    eventually("the gateway reports it as operational", lambda: plant.state() == "operational")
    plant.command("write", "plc", INPUT, "0x5A")
    eventually("an input reaches the PLC by PDO", lambda: plc.last("pdo") == 0x5A)
    plc.send_pdo(b"\x3c")
    eventually("what the PLC sends is in the image", lambda: plant.entry(0x6200) == (0x3C, True))
    check("6200h is as sent", plc.upload(DEVICE, 0x6200, 1) == b"\x3c")
    check("the PLC inverts the inputs", plc.download(DEVICE, 0x6002, 1, b"\xff") is None)
    eventually("the PLC receives the PDO", lambda: plc.last("pdo") == 0xA5)
    plant.command("emcy", "plc", "8130", "11")
    eventually("the PLC receives an EMCY", lambda: plc.last("emcy") == 0x8130)


def the_plc_stops_and_starts_it(plant):
    plc = plant.plc
    plc.nmt("stopNode", DEVICE)
    eventually("the device is stopped", lambda: plc.last("state") == STOPPED)
    eventually("the value of the PLC is invalid", lambda: plant.entry(0x6200) == (None, False))
    booted = plant.bus.boot_ups(DEVICE)
    plc.nmt("resetNode", DEVICE)
    eventually("it boots when it is reset", lambda: plant.bus.boot_ups(DEVICE) > booted)
    check("and has its defaults", plc.upload(DEVICE, 0x6002, 1) == b"\0")


def what_the_plc_stores_outlives_the_gateway(plant):
    upload, download = plant.plc.upload, plant.plc.download
    check("it configures the heartbeat", download(DEVICE, 0x1017, 0, u16(300)) is None)
    check("and the polarity", download(DEVICE, 0x6002, 1, b"\x81") is None)
    check("and stores both", download(DEVICE, 0x1010, 1, SAVE) is None)
    eventually("the device is heard", lambda: plant.plc.last("state") == PRE_OPERATIONAL)
    plant.linegated.kill()
    plant.plc.forget()
    eventually("the PLC misses it", lambda: plant.plc.last("silence") is not None)
    plant.plc.forget()
    plant.start()
    check("1017h is as stored", upload(DEVICE, 0x1017, 0) == u16(300))
    check("6002h is as stored", upload(DEVICE, 0x6002, 1) == b"\x81")
    eventually("the device is heard again", lambda: plant.plc.last("state") == PRE_OPERATIONAL)


def scenario():
    plant = Plant()
    the_plc_configures_the_device(plant)
    they_exchange_pdos(plant)
    the_plc_stops_and_starts_it(plant)
    what_the_plc_stores_outlives_the_gateway(plant)
    check("the gateway ends well", plant.linegated.stop() == 0)
    nothing_is_malformed(plant.bus.frames())


play(scenario)
