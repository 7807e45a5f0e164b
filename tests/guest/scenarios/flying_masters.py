#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Two gateways on one bus are flying masters (CiA 302-2). The active one is killed again and again: the other one takes
the network over. On the bus there is one active master at a time, a slave shows the inputs and sends no output, and a
new master sends none until it is written: an output of before is not valid."""

import os

from actors import Actor, Site, Witness, check, eventually, play

NODE = 12
KILLS = 4
EDS = os.path.abspath(os.path.join(os.path.dirname(__file__), "../../../bridges/sim/eds/digital-io.eds"))
GATEWAYS = {"hall-a": 20, "hall-b": 21}  # with the node-IDs of their own nodes
ACTIVE_MASTER, RPDO = 0x071, 0x200 + NODE
OUTPUTS = ("doors.Write output 8-bit.Outputs 1 to 8", "doors.Write output 8-bit.Outputs 9 to 16")
# The times are those of a guest that is a hundred times slower.
PLANT = """\
schema: 1
gateway: {{name: {name}}}
lines:
  - name: {name}
    interface: socketcan:vcan0
    bit_rate: 500kbit
    node_id: {node}
    heartbeat: 1s
    access: all
    flying_master: {{priority: 1, master_timeout: 2s, negotiation_delay: 2s, priority_slot: 2s, device_slot: 15ms, \
detect_cycle: 15s, master_heartbeat: 8s}}
    nodes: [{{id: 12, name: doors, eds: {eds}, heartbeat: 2s}}]
"""


class Halls(Site):
    def __init__(self):
        super().__init__()
        self.bus = Witness("vcan0")
        Actor("device", self.programs.linegate, "simulate", "socketcan:vcan0", "--device", f"digital-io:{NODE}")
        self.running = {}

    def start(self, name):
        self.running[name] = self.gateway(name, PLANT.format(name=name, node=GATEWAYS[name], eds=EDS))

    def kill(self, name):
        self.running.pop(name).kill()

    def states(self):
        """What the running gateways publish: role, state, active master, Operational nodes."""
        return {one["gateway"]: (one["role"], one["flying_master"], one["active_master"], one["nodes_operational"])
                for one in self.command("lines")["lines"] if one["gateway"] in self.running and not one["gone"]}

    def await_master(self, name):
        """Waits until this gateway is the active master and all others follow it."""
        node = GATEWAYS[name]
        wanted = {each: ("manager", "master", node, 1) if each == name else ("device", "slave", node, 1)
                  for each in self.running}
        eventually(f"{name} is the active master", lambda: self.states() == wanted)

    def valid(self, name, *options):
        return [entry["valid"] for entry in self.command("image", *options, name)["entries"] or []]

    def outputs_sent(self):
        self.bus.catch_up("vcan0")
        return [data for _, _, data in self.bus.frames(RPDO)]

    def masters(self):
        """The nodes that were the active master, in their order: each as often as it became it."""
        nodes = [data[1] for _, _, data in self.bus.frames(ACTIVE_MASTER)]
        return [node for place, node in enumerate(nodes) if place == 0 or node != nodes[place - 1]]


def the_master_sends_what_is_written(halls, master, value):
    check(f"{master}: no output is valid yet", True not in halls.valid(master, "--outputs"))
    sent = len(halls.outputs_sent())
    halls.held_back("write", master, OUTPUTS[0], str(value))
    halls.command("write", master, OUTPUTS[1], str(value))
    check(f"{master}: the outputs are valid", False not in halls.valid(master, "--outputs"))
    check(f"{master}: and are on the bus", bytes((value, value)) in halls.outputs_sent()[sent:])


def the_slave_is_one(halls, slave, master):
    eventually(f"{slave}: the inputs are valid", lambda: False not in halls.valid(slave))
    check(f"{slave}: no output is valid", True not in halls.valid(slave, "--outputs"))
    for words in (("write", slave, OUTPUTS[0], "1"), ("nmt", "stop", f"{slave}:{NODE}"),
                  ("sdo", "read", f"{slave}:{NODE}", "1000", "0", "u32")):
        said = halls.refused(*words)
        check(f"refused: {' '.join(words)}: {said.strip()}",
              f"node {GATEWAYS[master]} is the active NMT master" in said)


def scenario():
    halls = Halls()
    master, slave = GATEWAYS
    halls.start(master)
    halls.await_master(master)
    halls.start(slave)
    expected = [GATEWAYS[master]]
    for turn in range(KILLS):
        halls.await_master(master)
        the_master_sends_what_is_written(halls, master, turn + 1)
        the_slave_is_one(halls, slave, master)
        sent = halls.outputs_sent()
        halls.kill(master)
        halls.await_master(slave)
        check("the new master has sent no output", halls.outputs_sent() == sent)
        halls.start(master)
        master, slave = slave, master
        expected.append(GATEWAYS[master])
    halls.await_master(master)
    check(f"one active master at a time: {halls.masters()}", halls.masters() == expected)
    for name in (slave, master):
        check(f"{name} ends well", halls.running[name].stop() == 0)


play(scenario)
