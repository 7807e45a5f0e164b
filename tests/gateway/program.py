#!/usr/bin/python3
"""linegate program: a program of many chunks is loaded into a device, with progress; one that the device cannot use is
told in its words; and a gateway updates a device when it boots.

program.py LINEGATED LINEGATE PROFILES. The line is simulated inside the gateway.
"""

import json
import struct
import sys
import tempfile

import scan

EDS = scan.EDS
NEW = 0x00010002
PLANT = f"""schema: 1
gateway: {{name: program}}
lines:
  - name: press
    interface: "simulated:"
    bit_rate: 1Mbit
    access: all
    nodes:
      - {{id: 5, eds: {EDS}/drive.eds PROGRAM}}
    simulate:
      - {{node: 5, profile: drive}}
"""


def crc(data):
    value = 0
    for byte in data:
        value ^= byte << 8
        for _ in range(8):
            value = (value << 1 ^ 0x1021) & 0xFFFF if value & 0x8000 else value << 1
    return value


def program(identification, size):
    content = bytes(i * 7 & 0xFF for i in range(size))
    return b"LGFW" + struct.pack("<IH", identification, crc(content)) + content


class Loaded(scan.Plant):
    def booted(self):
        lines = json.loads(self.command("--json", "lines").stdout)["lines"]
        return bool(lines) and lines[0]["nodes_operational"] == 1

    def software(self):
        return int(json.loads(self.command("--json", "sdo", "read", "press:5", "1F56", "1", "u32").stdout)["value"])

    def run(self, folder, name, key):
        return self.gateway(scan.write(f"{folder}/{name}.yaml", PLANT.replace("PROGRAM", key)))


def run(plant, folder):
    good, bad = f"{folder}/good.bin", f"{folder}/bad.bin"
    for path, data in ((good, program(NEW, 150_000)), (bad, bytes(20_000))):
        with open(path, "wb") as file:
            file.write(data)
    process = plant.run(folder, "command", "")
    try:
        plant.until("the drive operational", plant.booted)
        told = plant.command("program", "press:5", good)
        if "150010 bytes loaded" not in told.stdout or "of 150010 bytes" not in told.stderr:
            raise scan.Failure(f"what was told of the program:\n{told.stdout}{told.stderr}")
        if plant.software() != NEW:
            raise scan.Failure(f"the device runs {plant.software()}")
        plant.until("the drive operational again", plant.booted)
        refused = plant.command("program", "press:5", bad, code=1).stderr
        if "1F57:1 is 00000004h, format of the program is unknown" not in refused:
            raise scan.Failure("what was told of a bad program:\n" + refused)
        if json.loads(plant.command("--json", "program", "press:5", good, "--number", "2", code=1).stdout)["ok"]:
            raise scan.Failure("there is no second program")
        plant.command("program", "press", good, code=2)
    finally:
        scan.end(process)
    process = plant.run(folder, "boot", f", program: {{identification: {NEW}, file: good.bin, update: true}}")
    try:
        plant.until("the drive operational", plant.booted)
        if plant.software() != NEW:
            raise scan.Failure(f"after the boot the device runs {plant.software()}")
    finally:
        scan.end(process)


def main(linegated, linegate, profiles):
    with tempfile.TemporaryDirectory() as folder:
        try:
            run(Loaded(linegated, linegate, profiles), folder)
        except scan.Failure as failure:
            return str(failure)
    return None


if __name__ == "__main__":
    if sys.argv[-1] != "--inside":
        scan.in_a_network_of_its_own(sys.argv)
    sys.exit(main(*sys.argv[1:-1]))
