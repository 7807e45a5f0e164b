#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Two foreign devices (Python) with the same node-ID: the second is connected while the first runs. The line detects
it from the frames of both, and does not just report a reboot; when one of them is removed, the line continues with
the other."""

from actors import Site, Witness, check, eventually, play, run
from python_stranger import PythonStranger

NODE, ALONE = 5, 6
PLANT = """\
schema: 1
gateway: {{name: guest}}
lines:
  - name: hall
    interface: socketcan:vcan0
    bit_rate: 500kbit
    access: all
    nodes:
      - {{id: 5, name: pump, eds: {pump}, heartbeat: 2s, objects: {{"2000:0": 1, "2001:0": one, "2002:0": 2}}}}
      - {{id: 6, name: fan, eds: {fan}, heartbeat: 2s}}
"""


class Hall(Site):
    def __init__(self):
        super().__init__()
        self.bus = Witness("vcan0")
        self.pump = PythonStranger("vcan0", NODE)
        self.fan = PythonStranger("vcan0", ALONE)
        self.linegated = self.gateway("hall", PLANT.format(pump=self.pump.eds, fan=self.fan.eds))

    def operational(self, node):
        return any(one["node"] == node and one["state"] == "operational" for one in self.command("nodes", "hall"))

    def shared(self):
        """Returns the node-IDs that the gateway reported as duplicate."""
        said = [line for line in self.linegated.text().splitlines() if "two devices have this node-ID" in line]
        return {node for node in (NODE, ALONE) if any(f"node {node} " in line for line in said)}

    def answers_twice(self):
        # All of an object at once: a console takes seconds to start, and several double answers in a row are needed.
        run(*self.console("sdo", "read", f"hall:{NODE}", "1018"))
        return "two answers to one SDO request" in self.linegated.text()


def scenario():
    hall = Hall()
    for node in (NODE, ALONE):
        eventually(f"node {node} is operational", lambda node=node: hall.operational(node))
    check("no node-ID is that of two devices", not hall.shared())
    booted = hall.bus.boot_ups(NODE)
    twin = PythonStranger("vcan0", NODE)
    eventually("the twin booted", lambda: hall.bus.boot_ups(NODE) > booted)
    # Their heartbeats may coincide, because a write of 1017h reaches both: then only the duplicate answers show it.
    eventually("two devices with one node-ID are reported by their answers to one SDO request", hall.answers_twice)
    check("and no other node-ID", hall.shared() == {NODE})
    twin.power_off()
    twin.kill()
    hall.command("nmt", "reset-node", f"hall:{NODE}")
    eventually("the line runs with the one that is left", lambda: hall.operational(NODE))
    check("no other node-ID was", hall.shared() == {NODE})
    check("the gateway ends well", hall.linegated.stop() == 0)


play(scenario)
