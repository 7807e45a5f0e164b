#!/usr/bin/python3
"""A foreign PLC (npm's `canopen`) is the master of a device of a line: it reads and configures the device by SDO, starts
and stops it, exchanges PDOs with it, hears its heartbeat and its EMCYs; what it stores in the device is there after the
gateway was killed. In the end tshark's CANopen dissector looks at every frame."""

import argparse
import os
import struct

from actors import FOLDER, Actor, Witness, ask, check, eventually, play
from capture import malformed_frames
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


class Plant:
    def __init__(self):
        parser = argparse.ArgumentParser()
        parser.add_argument("--linegated", required=True)
        parser.add_argument("--linegate", required=True)
        parser.add_argument("--modules", required=True)
        self.programs = parser.parse_args()
        self.bus = Witness("vcan0")
        self.plc = Stranger("vcan0", MASTER, self.programs.modules, "plc")
        check("the PLC is ready", self.plc.next_answer() == {"ready": True})
        self.start()

    def start(self):
        """The gateway; waits for the boot-up message of its device."""
        plant = os.path.join(FOLDER, "below.yaml")
        with open(plant, "w", encoding="utf-8") as file:
            file.write(PLANT.format(storage=os.path.join(FOLDER, "parameters")))
        booted = self.boot_ups()
        self.gateway = Actor("linegated", self.programs.linegated, plant)
        eventually("the device booted", lambda: self.boot_ups() > booted, 30)

    def boot_ups(self):
        return [data for _, _, data in self.bus.frames(0x700 + DEVICE)].count(b"\0")

    def command(self, *arguments):
        return ask(self.programs.linegate, "--json", "--wait", "30", "--timeout", "20", *arguments, within=60)

    def state(self):
        return next((node["state"] for node in self.command("nodes", "plc") if node["node"] == DEVICE), None)

    def entry(self, index, *options):
        """(value, valid) of the first entry of that object in the image."""
        entries = self.command("image", *options, "plc")["entries"] or []
        return next(((entry["value"], entry["valid"]) for entry in entries if entry["index"] == index), (None, None))


def the_plc_configures_the_device(plant):
    upload, download = plant.plc.upload, plant.plc.download
    check("1000h: digital inputs and outputs of CiA 401", upload(DEVICE, 0x1000, 0) == struct.pack("<I", 0x00030191))
    check("1008h is its name, in segments", upload(DEVICE, 0x1008, 0) == b"panel")
    said = download(DEVICE, 0x6000, 1, b"\x01")
    check(f"an input is not written: {said}", said is not None)
    check("it gets a heartbeat", download(DEVICE, 0x1017, 0, u16(250)) is None)
    eventually("and is heard: pre-operational", lambda: plant.plc.last("state") == PRE_OPERATIONAL, 10)


def they_exchange_pdos(plant):
    plc = plant.plc
    plc.nmt("startNode")  # the PLC itself
    plc.nmt("startNode", DEVICE)
    eventually("the PLC hears it: operational", lambda: plc.last("state") == OPERATIONAL, 10)
    eventually("and so the gateway says", lambda: plant.state() == "operational", 20)
    plant.command("write", "plc", INPUT, "0x5A")
    eventually("an input reaches the PLC by PDO", lambda: plc.last("pdo") == 0x5A, 20)
    plc.send_pdo(b"\x3c")
    eventually("what the PLC sends is in the image", lambda: plant.entry(0x6200) == (0x3C, True), 20)
    check("6200h is as sent", plc.upload(DEVICE, 0x6200, 1) == b"\x3c")
    check("the PLC inverts the inputs", plc.download(DEVICE, 0x6002, 1, b"\xff") is None)
    eventually("and gets them so", lambda: plc.last("pdo") == 0xA5, 20)
    plant.command("emcy", "plc", "8130", "11")
    eventually("an EMCY is told to the PLC", lambda: plc.last("emcy") == 0x8130, 20)


def the_plc_stops_and_starts_it(plant):
    plc = plant.plc
    plc.nmt("stopNode", DEVICE)
    eventually("the device is stopped", lambda: plc.last("state") == STOPPED, 10)
    eventually("what the PLC said is not valid any more", lambda: plant.entry(0x6200) == (None, False), 20)
    booted = plant.boot_ups()
    plc.nmt("resetNode", DEVICE)
    eventually("it boots when it is reset", lambda: plant.boot_ups() > booted, 10)
    check("and has its defaults", plc.upload(DEVICE, 0x6002, 1) == b"\0")


def what_the_plc_stores_outlives_the_gateway(plant):
    upload, download = plant.plc.upload, plant.plc.download
    check("it configures the heartbeat", download(DEVICE, 0x1017, 0, u16(300)) is None)
    check("and the polarity", download(DEVICE, 0x6002, 1, b"\x81") is None)
    check("and stores both", download(DEVICE, 0x1010, 1, SAVE) is None)
    eventually("the device is heard", lambda: plant.plc.last("state") == PRE_OPERATIONAL, 10)
    plant.gateway.kill()
    eventually("the PLC misses it", lambda: plant.plc.heard[-1][0] == "silence", 20)
    plant.start()
    check("1017h is as stored", upload(DEVICE, 0x1017, 0) == u16(300))
    check("6002h is as stored", upload(DEVICE, 0x6002, 1) == b"\x81")
    eventually("the device is heard again", lambda: plant.plc.last("state") == PRE_OPERATIONAL, 10)


def scenario():
    plant = Plant()
    the_plc_configures_the_device(plant)
    they_exchange_pdos(plant)
    the_plc_stops_and_starts_it(plant)
    what_the_plc_stores_outlives_the_gateway(plant)
    check("the gateway ends well", plant.gateway.stop() == 0)
    frames = plant.bus.frames()
    wrong = malformed_frames(frames)
    check(f"tshark finds nothing malformed in {len(frames)} frames: {wrong[:5]}", wrong == [])


play(scenario)
