# SPDX-License-Identifier: Apache-2.0
"""plant.yaml on three vcan interfaces: the gateway, the simulated devices of each line and two subscribers, each a
separate process."""

import os
from datetime import datetime

from actors import LAST_WORDS, Actor, Site, Witness, check, eventually
from subscribers import CycloneSubscriber, FastSubscriber

PLANT = os.path.join(os.path.dirname(os.path.abspath(__file__)), "plant.yaml")
INTERFACES = {"press": "vcan0", "hall": "vcan1", "pack": "vcan2"}
NODES = {"press": {5, 7}, "hall": {10, 12}, "pack": {20, 22}}


class Plant(Site):
    def __init__(self, configuration=PLANT):
        super().__init__("cyclone-images")
        programs = self.programs
        self.bus = {line: Witness(interface) for line, interface in INTERFACES.items()}
        self.devices = {line: self.simulate(line) for line in INTERFACES}
        # Also because the tests need the last events.
        self.running = Actor("linegated", programs.linegated, *LAST_WORDS, configuration)
        self.subscriber = FastSubscriber(programs.linegate)
        self.stranger = CycloneSubscriber(programs.cyclone_images)
        self.subscribers = (self.subscriber, self.stranger)
        for line in INTERFACES:
            eventually(f"{line}: all nodes are operational", lambda: self.is_up(line))

    def simulate(self, line):
        return Actor(f"devices-{line}", self.programs.linegate, "simulate", "--plant", PLANT, "--line", line)

    def is_up(self, line):
        """Whether both subscribers report the line as complete."""
        return all(is_up(line, subscriber.nodes(line)) for subscriber in self.subscribers)

    def stop(self):
        check("the gateway ends well on SIGTERM", self.running.stop() == 0)


def is_up(line, nodes):
    return set(nodes) == NODES[line] and all(
        node["presence"] == "present" and node["state"] == "operational" for node in nodes.values()
    )


def by_name(image):
    return {entry["name"]: entry for entry in image["entries"]}


def all_valid(image):
    return all(entry["valid"] for entry in image["entries"])


def utc_seconds(text):
    return datetime.fromisoformat(text).timestamp()
