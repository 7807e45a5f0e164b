#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""A value of one gateway is an output of a second one (`forward:`), and what a device there makes of it one of a third, each
on a host of its own. It arrives; after kill -9 of its gateway, or without the network, the reaction follows after the
time-out; it comes back after a restart, also at another place of the layout. A gateway that is not there, and an input that is
gone, are reported. With DDS-Security, in a shorter course: the halls have identities of one authority; identities of another
one receive nothing.

gateways.py LINEGATED LINEGATE same|own [secured]: the process of DDS
"""

import json
import os
import signal
import time

from doctor import DOMAIN, Setup
from hosts import await_ready, cable
from plant_process import EDS, PATIENCE, expect, run_test, until, write

SOURCE = "hall-b/press.inlet.Read input 8-bit.Inputs 9 to 16"
GROUP = 65535
TIMEOUT = 5  # seconds
LONG_CUT = 60  # seconds
INCOMPLETE = 3  # exit status of a console that sees a gateway of which it receives nothing: hall-b after its end
# Input 6000h:2 of a device shows its output 6200h:1.
PLANT_B = """schema: 1
gateway: {{name: hall-b}}
dds: {{process: {process}{security}}}
lines:
  - name: press
    interface: "simulated:"
    access: all
    simulate: [{simulate}]
    nodes: [{nodes}]
    outputs: {{defaults: {{{defaults}}}}}
"""
PLANT = """schema: 1
gateway: {{name: {gateway}}}
dds: {{process: {process}{security}}}
forward: [{rules}]
lines:
  - name: {line}
    interface: "simulated:"
    access: all
    simulate: [{{node: 9, profile: digital-io}}]
    nodes: [{{id: 9, name: display, eds: {eds}/digital-io.eds, heartbeat: 1s}}]
    outputs: {{defaults: {{"display.6200:2": 0}}}}
"""
RULE = '{{from: "{source}", to: "{line}.display.6200:{sub}", timeout: {timeout}s, when_lost: [zero, emcy]}}'


class Halls(Setup):
    """The gateways hall-b, whose value is forwarded, hall-a, and hall-c behind it."""

    def __init__(self, folder, linegated, linegate, process, secured=False):
        super().__init__(folder, linegated, linegate)
        self.process = process
        self.authority = os.path.join(folder, "authority") if secured else None
        if secured:
            self.security("init", self.authority)
            for role, names in (("gateway", ("hall-a", "hall-b", "hall-c")), ("engineer", ("desk",))):
                for name in names:
                    self.security("issue", self.authority, name, "--role", role)
        self.b, self.a = self.connected()
        self.c = self.host("store")
        cable(self.a, self.c, ("eth1", "eth0"))
        self.a.address("10.79.0.1/24", "eth1")
        self.c.address("10.79.0.2/24")
        await_ready(self.a, self.c)
        self.gateways = 0

    def start(self, host, text):
        self.gateways += 1
        plant = write(os.path.join(self.folder, f"{self.gateways}.yaml"), text)
        return host.start(self.linegated, plant, "--dds-domain", DOMAIN, "--dds-profile", self.profiles)

    def secured(self, gateway, authority=None):
        """The key of its identity in plant.yaml."""
        authority = authority or self.authority
        return f", security: {authority}/{gateway}" if authority else ""

    def ask(self, host, *words, **options):
        identity = os.path.join(self.authority, "desk") if self.authority else None
        return super().ask(host, *words, identity=identity, **options)

    def start_b(self, devices, authority=None):
        """devices: names by node-ID. authority: that of its identity."""
        nodes = ", ".join(f"{{id: {node}, name: {name}, eds: {EDS}/digital-io.eds, heartbeat: 1s}}"
                          for node, name in devices.items())
        return self.start(self.b, PLANT_B.format(
            process=self.process, security=self.secured("hall-b", authority), nodes=nodes, simulate=", ".join(f"{{node: {node}, profile: digital-io}}" for node in devices),
            defaults=", ".join(f'"{name}.6200:2": 0' for name in devices.values())))

    def start_a(self):
        return self.start(self.a, self.plant("hall-a", "pack", SOURCE))

    def start_c(self):
        return self.start(self.c, self.plant("hall-c", "store", "hall-a/pack.display.6000:2"))

    def plant(self, gateway, line, *sources):
        """With a rule for each source."""
        rules = (RULE.format(source=source, line=line, sub=1 + i, timeout=TIMEOUT) for i, source in enumerate(sources))
        return PLANT.format(process=self.process, security=self.secured(gateway), gateway=gateway, line=line, eds=EDS, rules=", ".join(rules))

    def write(self, value):
        """Sets the value of hall-b. Its gateway may start yet."""
        until(f"{value} is written", lambda: self.ask(self.b, "write", "hall-b/press", "inlet.6200:1", str(value),
                                                      wait=PATIENCE).returncode == 0)

    def outputs(self, host, line):
        """The process image of the outputs of a line."""
        def image():
            told = self.ask(host, "--json", "image", line, "--outputs", wait=PATIENCE)
            done = told.returncode in (0, INCOMPLETE)
            # Fast DDS 2.9.1 does not authenticate every console that joins late.
            expect(f"exit status {told.returncode}, {told.stderr}", done or self.authority is not None, True)
            return told.stdout if done else None
        return json.loads(until(f"the image of {line}", image))

    def value(self, host=None, line="hall-a/pack", sub=1):
        """The value of the output; None if it is not valid."""
        entries = self.outputs(host or self.a, line)["entries"] or ()  # None while the layout is not complete
        return next((one["value"] for one in entries if (one["index"], one["sub"]) == (0x6200, sub) and one["valid"]), None)

    def group(self):
        group, = (one for one in self.outputs(self.a, "hall-a/pack")["groups"] if one["group"] == GROUP)
        return group

    def becomes(self, value, why):
        until(f"the output is {value}, {why}", lambda: self.value() == value)

    def events(self, kind):
        """The texts of the events of that kind of the group of hall-a."""
        told = self.ask(self.a, "--json", "events", "hall-a/pack", "--once", wait=PATIENCE)
        events = [json.loads(line) for line in told.stdout.splitlines()]
        return [one["text"] for one in events if one["kind"] == kind and f"group {GROUP}" in one["text"]]

    def is_refused(self, why):
        """Waits until an event says why the value is not forwarded."""
        text = f"outputs of group {GROUP} (forwarded from {SOURCE}) of hall-b/press refused: {why}"
        until(f"refused: {why}", lambda: text in self.events("output-refused"))


LOST = (f"no valid value of {SOURCE} within the time-out of output group {GROUP}: outputs set to zero, "
        "EMCY sent or queued")
ARMED = f"outputs of group {GROUP} have a value of {SOURCE}, time-out {1000 * TIMEOUT} ms"


class Lost:
    """For a block in which the source is lost: at its end the reaction must have followed."""

    def __init__(self, halls, why):
        self.halls, self.why = halls, why

    def __enter__(self):
        self.before = len(self.halls.events("output-watchdog"))

    def __exit__(self, kind, *_):
        if kind is None:
            self.halls.becomes(0, self.why)
            until(f"an event, {self.why}", lambda: len(self.halls.events("output-watchdog")) > self.before)
            expect("the group waits", self.halls.group()["arming_wanted"], True)
            expect("the events", set(self.halls.events("output-watchdog")), {LOST})


def arrives(halls):
    halls.write(11)
    halls.becomes(11, "at first")
    expect("armed", halls.events("output-armed")[0], ARMED)
    expect("owner", halls.group()["owner"], "hall-b/press")
    time.sleep(2 * TIMEOUT)
    expect("an unchanged value remains", halls.value(), 11)
    until("it arrives in the third hall", lambda: halls.value(halls.c, "hall-c/store") == 11)
    told = halls.ask(halls.a, "write", "hall-a/pack", "display.6200:1", "1", wait=PATIENCE)
    expect("another writer is refused", (told.returncode != 0, "forward" in told.stderr), (True, True))


def is_cut(halls):
    """The network is cut for long, and for a second."""
    with Lost(halls, "without the network"):
        begin = time.monotonic()
        halls.b.run("ip", "link", "set", "eth0", "down")
    halls.write(13)  # on the host itself
    time.sleep(max(0, begin + LONG_CUT - time.monotonic()))
    expect("the output, until the network is there", halls.value(), 0)
    halls.b.run("ip", "link", "set", "eth0", "up")
    halls.becomes(13, "with the network again")
    halls.b.run("ip", "link", "set", "eth0", "down")
    time.sleep(1)
    halls.b.run("ip", "link", "set", "eth0", "up")
    halls.write(14)
    halls.becomes(14, "after a short cut")


def is_reloaded(halls, a):
    """With another rule for the same input. What is known of it remains."""
    write(a.args[a.args.index("--dds-domain") - 1], halls.plant("hall-a", "pack", SOURCE, "hall-b/press.inlet.6000:2"))
    a.send_signal(signal.SIGHUP)
    until("both outputs have the value", lambda: [halls.value(sub=sub) for sub in (1, 2)] == [14, 14])


def is_replaced(halls, a):
    """The process of DDS ends, and the next one receives everything again."""
    with open(f"/proc/{a.pid}/task/{a.pid}/children", encoding="utf-8") as file:
        child, = file.read().split()
    os.kill(int(child), signal.SIGKILL)
    halls.write(18)
    halls.becomes(18, "with another process of DDS")


def rogue(halls):
    """An authority that issued another identity of hall-b."""
    folder = os.path.join(halls.folder, "rogue")
    halls.security("init", folder)
    halls.security("issue", folder, "hall-b", "--role", "gateway")
    return folder


def with_security(halls):
    a = halls.start_a()
    halls.is_refused("the line of the other gateway is not, or not completely, received")
    b = halls.start_b({8: "inlet"})
    halls.write(11)
    halls.becomes(11, "at first")
    expect("owner", halls.group()["owner"], "hall-b/press")
    if halls.process == "own":
        is_replaced(halls, a)
    with Lost(halls, "after kill -9"):
        b.kill()
    b = halls.start_b({8: "inlet"}, rogue(halls))
    time.sleep(2 * TIMEOUT)
    expect("the output, while another authority's hall-b publishes", halls.value(), 0)
    b.kill()
    halls.start_b({8: "inlet"})
    halls.write(12)
    halls.becomes(12, "after a restart")


def test(folder, linegated, linegate, process, secured=None):
    halls = Halls(folder, linegated, linegate, process, secured == "secured")
    try:
        if secured:
            with_security(halls)
            return
        a = halls.start_a()
        halls.start_c()
        halls.is_refused("the line of the other gateway is not, or not completely, received")
        b = halls.start_b({8: "inlet"})
        arrives(halls)
        with Lost(halls, "after kill -9"):
            b.kill()
        b = halls.start_b({8: "inlet"})
        halls.write(12)
        halls.becomes(12, "after a restart")
        is_cut(halls)
        is_reloaded(halls, a)
        if process == "own":
            is_replaced(halls, a)
        with Lost(halls, "after the second kill -9"):
            b.kill()
        b = halls.start_b({7: "other", 8: "inlet"})
        halls.write(15)
        halls.becomes(15, "at another place of the layout")
        expect("nothing was refused", halls.group()["refused"], 0)
        with Lost(halls, "after the third kill -9"):
            b.kill()
        halls.start_b({8: "outlet"})
        halls.is_refused("the line of the other gateway has no such input")
        expect("the output remains as it was", halls.value(), 0)
    finally:
        halls.close()


if __name__ == "__main__":
    run_test(test, own_network=True)
