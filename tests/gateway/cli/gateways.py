#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""A value of one gateway is an output of another one (`forward:`), with both on hosts of their own: it arrives; after kill
-9 of its gateway, or without the network, the reaction follows after the time-out; it comes back after a restart, also at
another place of the layout; an input that is gone is refused.

gateways.py LINEGATED LINEGATE
"""

import json
import os
import time

from doctor import DOMAIN, Setup
from plant_process import EDS, Failure, PATIENCE, expect, run_test, until, write

SOURCE = "hall-b/press.inlet.Read input 8-bit.Inputs 9 to 16"
GROUP = 65535
TIMEOUT = 2  # seconds
# Input 6000h:2 of a device shows its output 6200h:1.
PLANT_B = """schema: 1
gateway: {{name: hall-b}}
lines:
  - name: press
    interface: "simulated:"
    access: all
    simulate: [{simulate}]
    nodes: [{nodes}]
    outputs: {{defaults: {{{defaults}}}}}
"""
PLANT_A = """schema: 1
gateway: {{name: hall-a}}
forward:
  - {{from: "{source}", to: "pack.display.6200:1", timeout: {timeout}s, when_lost: [zero, emcy]}}
lines:
  - name: pack
    interface: "simulated:"
    access: all
    simulate: [{{node: 9, profile: digital-io}}]
    nodes: [{{id: 9, name: display, eds: {eds}/digital-io.eds, heartbeat: 1s}}]
    outputs: {{defaults: {{"display.6200:2": 0}}}}
"""


class Halls(Setup):
    """The gateways hall-b, whose value is forwarded, and hall-a."""

    def __init__(self, *arguments):
        super().__init__(*arguments)
        self.b, self.a = self.connected()
        self.gateways = 0

    def start(self, host, text):
        self.gateways += 1
        plant = write(os.path.join(self.folder, f"{self.gateways}.yaml"), text)
        return host.start(self.linegated, plant, "--dds-domain", DOMAIN, "--dds-profile", self.profiles)

    def start_b(self, devices):
        """devices: names by node-ID."""
        nodes = ", ".join(f"{{id: {node}, name: {name}, eds: {EDS}/digital-io.eds, heartbeat: 1s}}"
                          for node, name in devices.items())
        return self.start(self.b, PLANT_B.format(
            nodes=nodes, simulate=", ".join(f"{{node: {node}, profile: digital-io}}" for node in devices),
            defaults=", ".join(f'"{name}.6200:2": 0' for name in devices.values())))

    def start_a(self):
        return self.start(self.a, PLANT_A.format(source=SOURCE, timeout=TIMEOUT, eds=EDS))

    def write(self, value):
        """Sets the value of hall-b. Its gateway may start yet."""
        until(f"{value} is written", lambda: self.ask(self.b, "write", "hall-b/press", "inlet.6200:1", str(value),
                                                      wait=PATIENCE).returncode == 0)

    def outputs(self):
        """The process image of the outputs of hall-a."""
        told = self.ask(self.a, "--json", "image", "hall-a/pack", "--outputs", wait=PATIENCE)
        expect(f"exit status, {told.stderr}", told.returncode, 0)
        images = json.loads(told.stdout)
        return images["images"][0] if "images" in images else images[0] if isinstance(images, list) else images

    def value(self):
        """The value of the output; None if it is not valid."""
        entry, = (one for one in self.outputs()["entries"] if (one["index"], one["sub"]) == (0x6200, 1))
        return entry["value"] if entry["valid"] else None

    def group(self):
        group, = (one for one in self.outputs()["groups"] if one["group"] == GROUP)
        return group

    def becomes(self, value, why):
        until(f"the output is {value}, {why}", lambda: self.value() == value)

    def events(self, kind):
        """The texts of the events of that kind of the line of hall-a."""
        told = self.ask(self.a, "--json", "events", "hall-a/pack", "--once", wait=PATIENCE)
        events = [json.loads(line) for line in told.stdout.splitlines()]
        return [one["text"] for one in events if one["kind"] == kind]


LOST = f"no valid value of {SOURCE} within the time-out of output group {GROUP}: outputs set to zero, EMCY sent"
ARMED = f"outputs of group {GROUP} have a value of {SOURCE}, time-out {1000 * TIMEOUT} ms"


def is_lost(halls, times, why):
    """The reaction followed for that time."""
    halls.becomes(0, why)
    until(f"{times} reactions, {why}", lambda: halls.events("output-watchdog") == [LOST] * times)
    expect("the group waits", halls.group()["arming_wanted"], True)


def test(folder, linegated, linegate):
    halls = Halls(folder, linegated, linegate)
    try:
        halls.start_a()
        b = halls.start_b({8: "inlet"})
        halls.write(11)
        halls.becomes(11, "at first")
        expect("armed", halls.events("output-armed"), [ARMED])
        expect("owner", halls.group()["owner"], "hall-b/press")
        time.sleep(2 * TIMEOUT)
        expect("an unchanged value remains", halls.value(), 11)
        told = halls.ask(halls.a, "write", "hall-a/pack", "display.6200:1", "1", wait=PATIENCE)
        expect("another writer is refused", (told.returncode != 0, "forward" in told.stderr), (True, True))

        b.kill()
        is_lost(halls, 1, "after kill -9")
        b = halls.start_b({8: "inlet"})
        halls.write(12)
        halls.becomes(12, "after a restart")

        halls.b.run("ip", "link", "set", "eth0", "down")
        is_lost(halls, 2, "without the network")
        halls.write(13)  # on the host itself
        halls.b.run("ip", "link", "set", "eth0", "up")
        halls.becomes(13, "with the network again")

        b.kill()
        is_lost(halls, 3, "after the second kill -9")
        b = halls.start_b({7: "other", 8: "inlet"})
        halls.write(14)
        halls.becomes(14, "at another place of the layout")
        expect("nothing was refused", halls.group()["refused"], 0)

        b.kill()
        is_lost(halls, 4, "after the third kill -9")
        halls.start_b({8: "outlet"})
        until("the input that is gone is refused", lambda: halls.events("output-refused") == [
            f"outputs of group {GROUP} (forwarded from {SOURCE}) of hall-b/press refused: the line of the other gateway "
            "has no such input"])
        expect("the output remains as it was", halls.value(), 0)
    finally:
        halls.close()


if __name__ == "__main__":
    run_test(test, own_network=True)
