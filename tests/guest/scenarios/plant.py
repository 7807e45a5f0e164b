"""plant.yaml on three vcan interfaces: the gateway, the simulated devices of each line and a subscriber, each a
process of its own."""

import argparse
import json
import os
from datetime import datetime

from actors import Actor, Failed, Witness, ask, check, eventually, run

PLANT = os.path.join(os.path.dirname(os.path.abspath(__file__)), "plant.yaml")
INTERFACES = {"press": "vcan0", "hall": "vcan1", "pack": "vcan2"}
NODES = {"press": {5, 7}, "hall": {10, 12}, "pack": {20, 22}}


class Subscriber(Actor):
    """`linegate monitor`, which prints everything it receives: events at once, the rest every 2 s."""

    def __init__(self, linegate):
        super().__init__("subscriber", linegate, "--json", "--wait", "60", "monitor")

    def received(self, member):
        """What was printed so far and has this member, oldest first."""
        complete = self.text().rpartition("\n")[0]
        objects = (json.loads(text) for text in complete.splitlines() if text.startswith("{"))
        return [found for found in objects if member in found]

    def images(self, line):
        return [
            image
            for image in self.received("direction")
            if image["line"] == line and image["entries"] is not None and "bytes" in image
        ]

    def image(self, line):
        """One that was received from now on."""
        so_far = len(self.images(line))
        eventually(f"{line}: a new image", lambda: len(self.images(line)) > so_far, 20)
        return self.images(line)[-1]

    def nodes(self, line):
        """{node-ID: NodeState}, the newest."""
        for picture in reversed(self.received("lines")):
            for state in picture["lines"]:
                if state["line"] == line:
                    return {node["node"]: node for node in state["nodes"]}
        return {}

    def events(self, line, kind, node=0):
        return [
            event
            for event in self.received("kind")
            if event["line"] == line and event["kind"] == kind and node in (0, event["node"])
        ]


class Plant:
    def __init__(self):
        parser = argparse.ArgumentParser()
        parser.add_argument("--linegated", required=True)
        parser.add_argument("--linegate", required=True)
        programs = parser.parse_args()
        self.linegate = programs.linegate
        self.bus = {line: Witness(interface) for line, interface in INTERFACES.items()}
        self.devices = {line: self.simulate(line) for line in INTERFACES}
        self.gateway = Actor("linegated", programs.linegated, PLANT)
        self.subscriber = Subscriber(programs.linegate)
        for line in INTERFACES:
            eventually(f"{line}: all nodes are operational", lambda: self.is_up(line), 60)

    def simulate(self, line):
        return Actor(f"devices-{line}", self.linegate, "simulate", "--plant", PLANT, "--line", line)

    def is_up(self, line):
        nodes = self.subscriber.nodes(line)
        return set(nodes) == NODES[line] and all(
            node["presence"] == "present" and node["state"] == "operational" for node in nodes.values()
        )

    def command(self, *arguments):
        """A console command that must be carried out: the JSON it printed."""
        return ask(self.linegate, "--json", "--wait", "30", "--timeout", "20", *arguments, within=60)

    def refused(self, *arguments):
        """A console command that must be refused: what it said."""
        status, text = run(self.linegate, "--wait", "30", "--timeout", "20", *arguments, within=60)
        if status != 1:
            raise Failed(f"{arguments} ended with {status}, not 1: {text}")
        return text

    def stop(self):
        check("the gateway ends well on SIGTERM", self.gateway.stop() == 0)


def by_name(image):
    return {entry["name"]: entry for entry in image["entries"]}


def all_valid(image):
    return all(entry["valid"] for entry in image["entries"])


def utc_seconds(text):
    return datetime.fromisoformat(text).timestamp()
