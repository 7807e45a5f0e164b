#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""linegate program: a program of many chunks is loaded into a device, with progress; a program that the device
rejects is reported with the reason; and a gateway updates a device when it boots.

program.py LINEGATED LINEGATE PROFILES. The line is simulated inside the gateway.
"""

from drive_program import program
from plant_process import EDS, Failure, Plant, run_test, write

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


class Loaded(Plant):
    def software(self):
        return int(self.json("sdo", "read", "press:5", "1F56", "1", "u32")["value"])

    def runs(self, folder, name, key):
        return self.running(write(f"{folder}/{name}.yaml", PLANT.replace("PROGRAM", key)))


def run(plant, folder):
    good, bad = f"{folder}/good.bin", f"{folder}/bad.bin"
    for path, data in ((good, program(NEW, 150_000)), (bad, bytes(20_000))):
        with open(path, "wb") as file:
            file.write(data)
    with plant.runs(folder, "command", ""):
        plant.await_operational("press", 1)
        told = plant.command("program", "press:5", good)
        if "150010 bytes loaded" not in told.stdout or "of 150010 bytes" not in told.stderr:
            raise Failure(f"what was told of the program:\n{told.stdout}{told.stderr}")
        if plant.software() != NEW:
            raise Failure(f"the device runs {plant.software()}")
        plant.await_operational("press", 1, "with the program")
        refused = plant.command("program", "press:5", bad, code=1).stderr
        if "1F57:01 is 00000004h, format of the program is unknown" not in refused:
            raise Failure("what was told of a bad program:\n" + refused)
        refused = plant.command("program", "press:5", "/proc/self/mem", code=1).stderr  # reading it fails with EIO
        if "/proc/self/mem cannot be read" not in refused:
            raise Failure("a file that fails while it is read:\n" + refused)
        if plant.json("program", "press:5", good, "--number", "2", code=1)["ok"]:
            raise Failure("there is no second program")
        plant.command("program", "press", good, code=2)
    with plant.runs(folder, "boot", f", program: {{identification: {NEW}, file: good.bin, update: true}}"):
        plant.await_operational("press", 1)
        if plant.software() != NEW:
            raise Failure(f"after the boot the device runs {plant.software()}")


def test(folder, linegated, linegate, profiles):
    run(Loaded(linegated, linegate, profiles, "199"), folder)


if __name__ == "__main__":
    run_test(test, own_network=True)
