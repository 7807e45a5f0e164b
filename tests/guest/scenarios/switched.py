#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""A device of another stack (Python) is switched off and on while a writer holds outputs: after each start it has
the output values of the image, although no client wrote them again."""

import struct

from actors import Site, Witness, check, eventually, play
from python_stranger import COMMANDED, PythonStranger

NODE = 21
OUTPUT = f"{NODE}.2002:0"
PLANT = """\
schema: 1
gateway: {{name: guest}}
lines:
  - name: hall
    interface: socketcan:vcan0
    bit_rate: 500kbit
    access: all
    nodes:
      - {{id: {node}, name: python, eds: {eds}, heartbeat: 2s, mandatory: false}}
"""


class Hall(Site):
    def __init__(self):
        super().__init__()
        self.bus = Witness("vcan0")
        self.python = PythonStranger("vcan0", NODE)
        self.linegated = self.gateway("hall", PLANT.format(node=NODE, eds=self.python.eds))

    def node(self):
        return next((node for node in self.command("nodes", "hall") if node["node"] == NODE), {})

    def operational(self):
        node = self.node()
        return node.get("presence") == "present" and node.get("state") == "operational"

    def shown(self):
        """Returns (value, valid) of the output in the image."""
        entries = self.command("image", "-o", "hall")["entries"] or []
        return next(((entry["value"], entry["valid"]) for entry in entries if entry["index"] == 0x2002), (None, None))

    def has(self, number):
        return self.python.server.objects[COMMANDED] == struct.pack("<I", number)


def switched_off_and_on(hall, number, missed):
    """missed: off until the gateway reports the heartbeat as lost; else on again within the heartbeat time."""
    hall.python.power_off()
    if missed:
        eventually("it is missing", lambda: hall.node().get("presence") == "missing")
        check("and its output is not shown as valid", hall.shown()[1] is False)
    hall.python.power_on()
    eventually(f"it has {number} again without a new write", lambda: hall.has(number))
    eventually("the image shows it as valid", lambda: hall.operational() and hall.shown() == (number, True))
    check("and the device has it", hall.has(number))


def scenario():
    hall = Hall()
    eventually("the device is operational", hall.operational)
    for number, missed in ((4711, True), (815, False), (42, True)):
        hall.command("write", "hall", OUTPUT, str(number))
        eventually(f"it has {number}", lambda: hall.has(number))
        switched_off_and_on(hall, number, missed)
    check("the gateway ends well", hall.linegated.stop() == 0)


play(scenario)
