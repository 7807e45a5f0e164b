#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""A gateway is killed at any moment: while it boots its nodes, while its own node and its devices store their
parameters, and while it is idle. After each kill it is started again and must reach the right state: all nodes
Operational, stored parameters the old or the new ones, the image the same.

kill.py LINEGATED LINEGATE PROFILES [SEED]. The bus is a multicast group in a separate network namespace; the
simulated devices on it belong to another program, which is not killed.
"""

import json
import os
import random
import subprocess
import time

from plant_process import EDS, Console, Failure, PATIENCE, end, run_test, simulated, write
from udp_bus import Bus, pause

ROUNDS = 51    # of two kills each
GROUP, PORT = "239.74.163.11", 43121
OWN = 127
BESIDE = {5: "drive", 7: "encoder", 8: "digital-io", 10: "analog-io"}  # simulated by the other program
INSIDE = {20: "drive", 21: "drive"}                                   # devices of the gateway
# Two objects of a node that are stored together, (index, sub-index, bytes, number added to a small number): the inhibit
# time of EMCYs, and the consumer heartbeat time of node 100, which does not exist.
PAIR = ((0x1015, 0, 2, 0), (0x1016, 1, 4, 100 << 16))
STORING = (OWN, *INSIDE)

PLANT = """schema: 1
gateway: {{name: kill, log: warning}}
dds: {{domain: 198, profile: {profiles}}}
lines:
  - name: press
    interface: "udp:{group}:{port}"
    bit_rate: 1Mbit
    network_id: 1
    node_id: {own}
    heartbeat: 20ms
    sync: 20ms
    storage: {folder}/stored
    access: all
    nodes:
{nodes}
  - name: below
    interface: "udp:{group}:{port}"
    network_id: 2
    role: device
    storage: {folder}/stored
    access: all
    devices:
{devices}
"""


class Plant(Console):
    def __init__(self, linegated, linegate, profiles, folder):
        super().__init__(linegate, profiles, "198")
        self.program = linegated
        nodes = "".join(f"      - {{id: {node}, eds: {EDS}/{profile}.eds, heartbeat: 20ms}}\n"
                        for node, profile in {**BESIDE, **INSIDE}.items())
        devices = "".join(f"      - {{id: {node}, name: d{node}, eds: {EDS}/{profile}.eds}}\n"
                          for node, profile in INSIDE.items())
        self.file = write(os.path.join(folder, "plant.yaml"),
                          PLANT.format(profiles=profiles, group=GROUP, port=PORT, own=OWN, folder=folder, nodes=nodes,
                                       devices=devices))
        self.bus = Bus(GROUP, PORT)
        self.process = None
        # By node: the generations of values that may be stored. None until the first one is known.
        self.stored = {node: None for node in STORING}

    def start(self):
        self.bus.forget()
        self.process = subprocess.Popen([self.program, self.file, "--last-words", "0"])

    def kill(self):
        if self.process.poll() is not None:
            raise Failure(f"the gateway ended by itself, with {self.process.returncode}")
        self.process.kill()
        self.process.wait()

    def look(self):
        """A start without a kill: all nodes run, and have the stored values."""
        self.start()
        self.await_operational()
        self.check_stored()

    def await_operational(self):
        nodes = [OWN, *BESIDE, *INSIDE]
        if not self.bus.operational(nodes, PATIENCE):
            raise Failure(f"not all nodes are Operational: {self.bus.states}, booted {self.bus.booted}")

    def generation(self, node):
        """Returns the generation of values that the node has. Both of its objects must have the same generation."""
        values = [self.bus.read(node, index, sub) for index, sub, _, _ in PAIR]
        if None in values or len({value - base for value, (_, _, _, base) in zip(values, PAIR)}) > 1:
            raise Failure(f"node {node} has {values}: neither what was stored nor what was to be")
        return values[0]

    def check_stored(self):
        for node, known in self.stored.items():
            if known is None:
                continue
            found = self.generation(node)
            if found not in known:
                raise Failure(f"node {node} has generation {found}, not one of {known}")
            self.stored[node] = {found}

    def store(self, node, generation):
        """Requests a store without waiting for its end."""
        for index, sub, size, base in PAIR:
            if not self.bus.write(node, index, sub, base + generation, size):
                raise Failure(f"node {node} does not take {index:04X}h")
        self.bus.begin_save(node)
        self.stored[node] = (self.stored[node] or set()) | {generation}

    def store_for_certain(self, generation):
        for node in STORING:
            for index, sub, size, base in PAIR:
                self.bus.write(node, index, sub, base + generation, size)
            if not self.bus.write(node, 0x1010, 1, int.from_bytes(b"save", "little"), 4):
                raise Failure(f"node {node} does not store")
            self.stored[node] = {generation}

    def image(self):
        """Returns the identity of both images of the manager, once all inputs are valid."""
        last = time.monotonic() + PATIENCE
        while True:
            told = [self.ask("--json", "image", "press", *which) for which in ((), ("--outputs",))]
            if all(one.returncode == 0 for one in told):
                images = [json.loads(one.stdout.splitlines()[0]) for one in told]
                if all(entry["valid"] for entry in images[0]["entries"]):
                    return [image["layout_id"] for image in images]
            if time.monotonic() > last:
                raise Failure(f"inputs are not valid: {told[0].stdout}{told[0].stderr}")
            time.sleep(0.2)


def run(plant, chance):
    began = time.monotonic()
    plant.look()
    boot_time = time.monotonic() - began
    wanted = plant.image()
    generation = 1
    plant.store_for_certain(generation)
    plant.kill()
    for number in range(ROUNDS):
        plant.look()
        if number % 10 == 0 and plant.image() != wanted:
            raise Failure("the image is another one")
        if number % 3 != 2:
            generation += 1
            for node in chance.sample(STORING, chance.randint(1, len(STORING))):
                plant.store(node, generation)
            # A store takes some milliseconds: most kills occur during one.
            pause(chance.choice((0, chance.uniform(0, 0.004), chance.uniform(0, 0.05))))
        else:
            pause(chance.uniform(0, 0.3))
        plant.kill()
        plant.look()
        end(plant.process)
        plant.start()
        pause(chance.uniform(0, 1.2 * boot_time))  # during start-up, opening of lines, and boot of nodes
        plant.kill()
    plant.look()
    if plant.image() != wanted:
        raise Failure("the image is another one at the end")
    end(plant.process)


def test(folder, linegated, linegate, profiles, seed=None):
    seed = int(seed) if seed is not None else random.SystemRandom().randrange(1 << 32)
    print(f"seed {seed}: {2 * ROUNDS + 1} kills", flush=True)
    with simulated(linegate, f"udp:{GROUP}:{PORT}", BESIDE):
        plant = Plant(linegated, linegate, profiles, folder)
        try:
            run(plant, random.Random(seed))
        except Failure as failure:
            raise Failure(f"seed {seed}: {failure}") from failure
        finally:
            if plant.process is not None and plant.process.poll() is None:
                plant.process.kill()


if __name__ == "__main__":
    run_test(test, own_network=True)
