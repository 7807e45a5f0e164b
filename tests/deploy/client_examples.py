#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""An example of deploy/client, built against the installed library, at a gateway: it prints values, holds its output and
sends its command. The gateway is killed and started again, and the network is cut for longer than any time of discovery:
the example prints each loss, and holds the output again.

client_examples.py BUILD LINEGATED LINEGATE LANGUAGE [secured]. In a separate network namespace; secured: the gateway, with
DDS-Security, is in another one, which stands for another host.
"""

import json
import os
import signal
import subprocess
import sys

from installed_client import EXAMPLES, Installed

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "gateway", "cli"))
from plant_process import Failure, end, run_test, until, write  # noqa: E402 pylint: disable=wrong-import-position

CUT = 60  # seconds
MULTICAST = "224.0.0.0/4"  # DDS announces participants there
LOST = ("press: lost", "press: silent")


class Example:
    """The example as a process; what it prints is read from a file."""

    def __init__(self, folder, command, environment):
        self.path, self.passed = os.path.join(folder, "output"), 0
        with open(self.path, "wb") as output:
            self.process = subprocess.Popen(command, stdout=output, stderr=subprocess.STDOUT, env=environment)

    def lines(self):
        if self.process.poll() is not None:
            raise Failure(f"the example ended with {self.process.returncode}: {self.text()}")
        return self.text().splitlines()

    def text(self):
        with open(self.path, encoding="utf-8") as file:
            return file.read()

    def expect(self, *beginnings):
        """Waits for lines that begin so, in any order, after the last ones that were expected."""
        def found():
            lines = self.lines()[self.passed:]
            places = [next((i for i, line in enumerate(lines) if line.startswith(wanted)), None)
                      for wanted in beginnings]
            if None in places:
                return False
            self.passed += max(places) + 1
            return True
        try:
            until(f"the example prints {beginnings}", found)
        except Failure as failure:
            raise Failure(f"{failure}\n{self.text()}") from failure


class Loopback:
    """The network of the test is loopback: the gateway is on the host of the example."""

    gateway_host = ()  # what the command of the gateway begins with

    def cut(self):
        set_link("lo", "down")

    def mend(self):
        set_link("lo", "up")
        command("ip", "route", "add", MULTICAST, "dev", "lo")

    def close(self):
        pass


class TwoHosts:
    """The gateway is in a network namespace of its own, joined to the one of the example by a pair of interfaces."""

    def __init__(self):
        self.host = subprocess.Popen(["unshare", "--net", "sleep", "infinity"])
        self.gateway_host = ("nsenter", "--target", str(self.host.pid), "--net")
        until("the other namespace exists", lambda: os.readlink(f"/proc/{self.host.pid}/ns/net") !=
              os.readlink("/proc/self/ns/net"))
        command("ip", "link", "add", "client", "type", "veth", "peer", "name", "gateway", "netns", str(self.host.pid))
        self.set_up("client", 1, ())
        self.set_up("gateway", 2, self.gateway_host)

    @staticmethod
    def set_up(interface, number, host):
        command(*host, "ip", "address", "add", f"10.74.163.{number}/24", "dev", interface)
        command(*host, "ip", "link", "set", "lo", "up")
        command(*host, "ip", "link", "set", interface, "up")
        command(*host, "ip", "route", "replace", MULTICAST, "dev", interface)

    def cut(self):
        set_link("client", "down")

    def mend(self):
        set_link("client", "up")
        command("ip", "route", "replace", MULTICAST, "dev", "client")

    def close(self):
        self.host.kill()


class Machine:
    """The gateway, and the console on its host that reads what its device has."""

    def __init__(self, linegated, linegate, plant, network):
        self.linegated, self.linegate = [*network.gateway_host, linegated, plant], [*network.gateway_host, linegate]
        self.gateway = None

    def start(self):
        self.gateway = subprocess.Popen(self.linegated)

    def kill(self):
        self.gateway.send_signal(signal.SIGKILL)
        self.gateway.wait()

    def lamps(self):
        """The outputs that the device has; None while it does not answer."""
        told = subprocess.run([*self.linegate, "--json", "sdo", "read", "press:8", "6200:01", "u8"], capture_output=True,
                              text=True, check=False)
        return json.loads(told.stdout).get("value") if told.returncode == 0 else None

    def expect_held(self, example, *others):
        example.expect("lamps: held", *others)
        until("the device has the output", lambda: self.lamps() == "5")


def command(*words):
    subprocess.run(words, check=True)


def set_link(interface, state):
    command("ip", "link", "set", interface, state)


def secured_plant(folder, linegate):
    """The plant of the examples with DDS-Security. Returns its file, and the folder of an operator's identity."""
    identities = os.path.join(folder, "identities")
    command(linegate, "security", "init", identities)
    command(linegate, "security", "issue", identities, "cell", "--role", "gateway")
    command(linegate, "security", "issue", identities, "operator", "--role", "operator")
    with open(os.path.join(EXAMPLES, "plant.yaml"), encoding="utf-8") as file:
        text = file.read().replace("../../bridges", os.path.join(os.path.dirname(os.path.dirname(EXAMPLES)), "bridges"))
    return (write(os.path.join(folder, "plant.yaml"), text + f"dds: {{security: {os.path.join(identities, 'cell')}}}\n"),
            os.path.join(identities, "operator"))


def run(machine, network, example):
    machine.start()
    example.expect("panel.Read input bit.Input 1 = ")
    machine.expect_held(example, "vendor: ")
    machine.kill()
    example.expect("lamps: lost")
    machine.start()
    machine.expect_held(example, "vendor: ")
    network.cut()
    signal.sigtimedwait([], CUT)
    network.mend()
    example.expect("lamps: lost")
    machine.expect_held(example)
    end(machine.gateway)
    example.expect("lamps: lost")
    if not any(line.startswith(LOST) for line in example.lines()):
        raise Failure(f"the loss of the line was not printed: {example.text()}")


def test(folder, build, linegated, linegate, language, secured=""):
    installed = Installed(build, folder)
    examples = installed.examples()
    plant = os.path.join(EXAMPLES, "plant.yaml")
    if secured:
        plant, os.environ["LINEGATE_SECURITY"] = secured_plant(folder, linegate)  # of the example and of the console
    network = TwoHosts() if secured else Loopback()
    example = Example(folder, examples[language], {**os.environ, **installed.environment})
    machine = Machine(linegated, linegate, plant, network)
    try:
        run(machine, network, example)
    finally:
        print("\n".join(line for line in example.text().splitlines() if " = " not in line))
        example.process.kill()
        if machine.gateway is not None and machine.gateway.poll() is None:
            machine.kill()
        network.close()


if __name__ == "__main__":
    run_test(test, own_network=True)
