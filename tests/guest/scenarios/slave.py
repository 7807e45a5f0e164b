#!/usr/bin/python3
"""A line whose own node is an NMT slave (IXXAT's slave mode) beside a foreign master (npm's `canopen`): the master resets,
starts and stops it; the line sends no NMT command, whatever resets its node."""

from actors import Site, Witness, check, eventually, play
from stranger import Stranger

OWN, MASTER = 20, 100
PLANT = f"""\
schema: 1
gateway: {{name: guest}}
lines:
  - name: hall
    interface: socketcan:vcan0
    bit_rate: 500kbit
    node_id: {OWN}
    access: all
    heartbeat: 250ms
    own_values: {{1F80:0: 0}}
"""
OPERATIONAL, STOPPED = 5, 4


class Hall(Site):
    def __init__(self):
        super().__init__("modules")
        self.bus = Witness("vcan0")
        self.master = Stranger("vcan0", MASTER, self.programs.modules, "plc")
        check("the master is ready", self.master.next_answer() == {"ready": True})
        self.linegated = self.gateway("hall", PLANT)
        eventually("the own node booted", lambda: self.bus.boot_ups(OWN) > 0)

    def commanded(self, command):
        """By the master; the own node boots again."""
        booted = self.bus.boot_ups(OWN)
        self.master.nmt(command, OWN)
        eventually(f"{command} by the master", lambda: self.bus.boot_ups(OWN) > booted)

    def heard(self, state):
        return self.bus.frames(0x700 + OWN)[-1][2] == bytes([state])


def scenario():
    hall = Hall()
    hall.commanded("resetNode")
    hall.commanded("resetCommunication")
    hall.master.nmt("startNode", OWN)
    eventually("it is operational", lambda: hall.heard(OPERATIONAL))
    hall.master.nmt("stopNode", OWN)
    eventually("it is stopped", lambda: hall.heard(STOPPED))
    said = hall.refused("nmt", "reset-node", "hall:all")
    print(f"ok: what a console commands to others is refused: {said}")
    hall.commanded("resetNode")
    hall.bus.catch_up("vcan0")
    sent = [data for _, _, data in hall.bus.frames(0x000)]
    wanted = [bytes([command, OWN]) for command in (0x81, 0x82, 0x01, 0x02, 0x81)]
    check(f"the bus had the master's NMT commands and no other: {sent}", sent == wanted)
    check("the gateway ends well", hall.linegated.stop() == 0)


play(scenario)
