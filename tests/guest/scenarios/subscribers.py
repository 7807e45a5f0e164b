# SPDX-License-Identifier: Apache-2.0
"""Two subscribers with different DDS implementations, which report the samples they received in the same form:
lines, nodes, images and events with the names of `linegate --json`."""

import json
import os
import re
from datetime import datetime, timezone

from actors import PATIENCE, Actor, Failed, check, eventually, read

REPOSITORY = os.path.abspath(os.path.join(os.path.dirname(__file__), "../../.."))
NMT_STATES = {0: "initialising", 4: "stopped", 5: "operational", 127: "pre-operational", 255: "unknown"}


class Subscriber(Actor):
    """A program that prints one JSON object per line."""

    def __init__(self, name, *command, environment=None):
        self._read = 0
        self._received = []
        super().__init__(name, *command, environment=environment)

    def received(self, member):
        """Returns the printed objects that have this member, oldest first."""
        with open(self.path, "rb") as log:
            log.seek(self._read)
            complete = log.read().rpartition(b"\n")[0]
        if complete:
            self._read += len(complete) + 1
            objects = (json.loads(text) for text in complete.splitlines() if text.startswith(b"{"))
            self._received += objects
        return [found for found in self._received if member in found]

    def image(self, line):
        """Waits for an image that is received from now on, and returns it."""
        so_far = len(self.images(line))
        eventually(f"{line}: {self.name} has a new image", lambda: len(self.images(line)) > so_far)
        return self.images(line)[-1]


class FastSubscriber(Subscriber):
    """`linegate monitor` (Fast DDS): events at once, the newest of all other samples every 2 s."""

    def __init__(self, linegate):
        super().__init__("Fast DDS", linegate, "--json", "--wait", str(PATIENCE), "monitor")

    def images(self, line):
        """Returns the images of the inputs that have a layout."""
        return [
            image
            for image in self.received("direction")
            if (image["line"], image["direction"]) == (line, "inputs")
            and image["entries"] is not None
            and "bytes" in image
        ]

    def line(self, line):
        """Returns its newest LineState and NodeStates."""
        for picture in reversed(self.received("lines")):
            for state in picture["lines"]:
                if state["line"] == line:
                    return state
        return {}

    def bus(self, line):
        """Returns its newest bus state."""
        return self.line(line).get("bus")

    def nodes(self, line):
        """Returns {node-ID: NodeState}, the newest of each."""
        return {node["node"]: node for node in self.line(line).get("nodes", [])}

    def events(self, line, kind=None, node=0):
        return [
            event
            for event in self.received("severity")
            if event["line"] == line and kind in (None, event["kind"]) and node in (0, event["node"])
        ]


class CycloneSubscriber(Subscriber):
    """cyclone_images of tests/interop: prints every sample as received, in C and with types made by idlc. Its output
    is interpreted here, without code of the product."""

    def __init__(self, program):
        profile = "file://" + os.path.join(REPOSITORY, "tests/interop/cyclone.xml")
        super().__init__("Cyclone DDS", program, "0", environment={"CYCLONEDDS_URI": profile})
        self._kinds = enumerators("EventKind")
        self._directions = enumerators("Direction")
        self._presences = enumerators("Presence")
        self._buses = ["bus-off" if name == "off" else name for name in enumerators("BusState")]

    def samples(self, topic, line):
        return [s for s in self.received("topic") if (s["topic"], s["line"]) == (topic, line)]

    def images(self, line, direction="inputs"):
        """Returns the images of one direction that have a layout."""
        code = self._directions.index(direction)
        layouts = {}
        for part in self.samples("ImageLayout", line):
            layouts.setdefault(part["layout_id"], {})[part["part"]] = part
        return [
            self._explained(image, layouts[image["layout_id"]])
            for image in self.samples("ProcessImage", line)
            if image["direction"] == code and is_complete(layouts.get(image["layout_id"], {}))
        ]

    @staticmethod
    def _explained(image, parts):
        area = int.from_bytes(bytes.fromhex(image["bytes"]), "little")
        valid = int.from_bytes(bytes.fromhex(image["valid"]), "little")
        entries = []
        for entry in (entry for number in sorted(parts) for entry in parts[number]["entries"]):
            length = entry["bit_length"]
            value = (area >> entry["bit_offset"]) & ((1 << length) - 1)
            octets = value.to_bytes((length + 7) // 8, "little").hex().upper()
            is_valid = bool(valid >> len(entries) & 1)
            entries.append({"name": entry["name"], "valid": is_valid, "bytes": octets})
        return {"sequence": image["sequence_number"], "bytes": image["bytes"], "entries": entries}

    def buses(self, line):
        """Returns its bus states, one for each LineState with a change."""
        found = []
        for state in self.samples("LineState", line):
            if not found or found[-1] != self._buses[state["bus"]]:
                found.append(self._buses[state["bus"]])
        return found

    def bus(self, line):
        """Returns the newest bus state."""
        return self.buses(line)[-1] if self.buses(line) else None

    def nodes(self, line):
        """Returns {node-ID: NodeState}, the newest of each."""
        return {
            state["node"]: {
                **state,
                "presence": self._presences[state["presence"]],
                "state": NMT_STATES[state["state"]],
            }
            for state in self.samples("NodeState", line)
        }

    def events(self, line, kind=None, node=0):
        return [
            {**event, "kind": self._kinds[event["kind"]], "time": utc_text(event["time"])}
            for event in self.samples("Event", line)
            if kind in (None, self._kinds[event["kind"]]) and node in (0, event["node"])
        ]


def enumerators(name):
    """Returns the enumerators of an enumeration in the contract, by their printed names."""
    contract = re.sub(r"//.*", "", read(os.path.join(REPOSITORY, "idl/linegate.idl")))
    members = re.search(rf"\benum {name} {{([^}}]*)}}", contract)[1].split(",")
    return [member.strip().partition("_")[2].lower().replace("_", "-") for member in members]


def is_complete(parts):
    return bool(parts) and len(parts) == next(iter(parts.values()))["parts"]


def utc_text(nanoseconds):
    return datetime.fromtimestamp(nanoseconds / 1e9, timezone.utc).isoformat()


def in_short(image):
    """Returns the parts of an image that both subscribers print."""
    entries = [(entry["name"], entry["valid"], entry["bytes"]) for entry in image["entries"]]
    return image["bytes"], entries


def same_images(line, one, other):
    """Compares the images that both received. Either may miss an image that was replaced by the next one."""

    def pairs():
        images = {image["sequence"]: image for image in other.images(line)}
        return [(i, images[i["sequence"]]) for i in one.images(line) if i["sequence"] in images]

    both = eventually(f"{line}: three images reached both subscribers", lambda: pairs()[2:] and pairs())
    for image, twin in both:
        if in_short(image) != in_short(twin):
            check(f"{line}: {in_short(image)} and {in_short(twin)} are the same", False)
    check(f"{line}: {len(both)} images are the same in both, byte for byte and name by name", True)


def same_events(line, one, other):
    """Compares all events, from the first to the last one of the gateway: a late joiner receives past events."""

    def told(subscriber):
        members = ("number", "kind", "node", "code", "value", "data", "text")
        return [tuple(event[member] for member in members) for event in subscriber.events(line)]

    try:
        eventually(
            f"{line}: {one.name} and {other.name} have the same events, number 1 to the last",
            lambda: told(one) == told(other)
            and [number for number, *_ in told(one)] == list(range(1, len(told(one)) + 1)),
        )
    except Failed:
        for subscriber, twin in ((one, other), (other, one)):
            print(f"only {subscriber.name}: {[event for event in told(subscriber) if event not in told(twin)]}")
        raise
