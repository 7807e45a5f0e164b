#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Two gateways on one bus are flying masters. The active one is killed again and again: the other one boots the network as
the active master, and before that refuses commands with the node-ID of the master.

flying_masters.py LINEGATED LINEGATE PROFILES
"""

import os
import signal

from plant_process import EDS, Failure, Plant, own_domain, run_test, simulated, until, write

BUS = "udp:239.74.163.9:43125"
GATEWAYS = {"hall-a": 20, "hall-b": 21}  # with the node-IDs of their own nodes
KILLS = 6
PLANT = """schema: 1
gateway: {{name: {name}}}
lines:
  - name: {line}
    interface: "{bus}"
    node_id: {node}
    heartbeat: 200ms
    access: all
    flying_master: {{priority: 1, negotiation_delay: 200ms, priority_slot: 400ms, device_slot: 3ms, detect_cycle: 2s}}
    nodes: [{{id: 5, name: io, eds: {eds}/digital-io.eds, heartbeat: 200ms}}]
"""


class Halls(Plant):
    def __init__(self, folder, *programs):
        super().__init__(*programs, own_domain())
        self.files = {name: write(os.path.join(folder, name + ".yaml"),
                                  PLANT.format(name=name, line=name[-1], bus=BUS, node=node, eds=EDS))
                      for name, node in GATEWAYS.items()}
        self.processes = {}

    def start(self, name):
        self.processes[name] = self.gateway(self.files[name])

    def kill(self, name):
        process = self.processes.pop(name)
        process.send_signal(signal.SIGKILL)
        process.wait()

    def states(self):
        """What the running gateways say of themselves: role, state, active master, Operational nodes."""
        return {one["gateway"]: (one["role"], one["flying_master"], one["active_master"], one["nodes_operational"])
                for one in self.lines() if one["gateway"] in self.processes and not one["gone"]}

    def await_master(self, name):
        """Waits until this gateway is the active master and all others follow it."""
        node = GATEWAYS[name]
        wanted = {each: ("manager", "master", node, 1) if each == name else ("device", "slave", node, 1)
                  for each in self.processes}
        until(f"{name} is the active master", lambda: self.states() == wanted)

    def check_slave(self, name, master):
        """A slave refuses a command, and names the master."""
        told = self.ask("nmt", "stop", f"{name}/{name[-1]}:5")
        if told.returncode == 0 or f"node {GATEWAYS[master]} is the active NMT master" not in told.stderr:
            raise Failure(f"nmt at the slave {name}: {told.returncode} {told.stdout}{told.stderr}")


def test(folder, linegated, linegate, profiles):
    halls = Halls(folder, linegated, linegate, profiles)
    with simulated(linegate, BUS, {5: "digital-io"}):
        try:
            halls.start("hall-a")
            halls.await_master("hall-a")
            halls.start("hall-b")
            master, other = "hall-a", "hall-b"
            for _ in range(KILLS):
                halls.await_master(master)
                halls.check_slave(other, master)
                halls.kill(master)
                halls.await_master(other)
                halls.start(master)
                master, other = other, master
            halls.await_master(master)
        finally:
            for name in list(halls.processes):
                halls.kill(name)


if __name__ == "__main__":
    run_test(test, own_network=True)
