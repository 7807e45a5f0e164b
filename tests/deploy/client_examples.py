#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""An example of deploy/client, built against the installed library, at a gateway: it prints values, holds its output and
sends its command. The gateway is killed and started again, and the network is cut for longer than any time of discovery:
the example prints each loss, and holds the output again.

client_examples.py BUILD LINEGATED LINEGATE LANGUAGE [secured]. On loopback of a separate network namespace; secured: with
DDS-Security, and each on a host of its own.
"""

import json
import os
import signal
import subprocess
import sys

from installed_client import EXAMPLES, Installed, example_plant

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "gateway", "cli"))
from hosts import Host, await_ready, cable, run  # noqa: E402 pylint: disable=wrong-import-position
from plant_process import Failure, end, run_test, until  # noqa: E402 pylint: disable=wrong-import-position

CUT = 60  # seconds
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
    """The network of the test is loopback: gateway and example are on one host."""

    @staticmethod
    def on_desk(*words):
        return words

    on_cell = on_desk

    def cut(self):
        run("ip", "link", "set", "lo", "down")

    def mend(self):
        run("ip", "link", "set", "lo", "up")
        run("ip", "route", "add", "224.0.0.0/4", "dev", "lo")  # DDS announces participants there

    def close(self):
        pass


class TwoHosts:
    """The gateway is on the host `cell`, the example on the host `desk`."""

    def __init__(self):
        self.cell, self.desk = Host("cell"), Host("desk")
        self.on_cell, self.on_desk = self.cell.words, self.desk.words
        cable(self.cell, self.desk)
        self.cell.address("10.77.0.1/24")
        self.desk.address("10.77.0.2/24")
        await_ready(self.cell, self.desk)

    def cut(self):
        self.desk.run("ip", "link", "set", "eth0", "down")

    def mend(self):
        self.desk.run("ip", "link", "set", "eth0", "up")

    def close(self):
        self.cell.close()
        self.desk.close()


class Machine:
    """The gateway, and the console on its host that reads what its device has."""

    def __init__(self, linegated, linegate, plant, network):
        self.linegated, self.linegate = network.on_cell(linegated, plant), network.on_cell(linegate)
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


def secured_plant(folder, linegate):
    """The plant of the examples with DDS-Security. Returns its file, and the folder of an operator's identity."""
    identities = os.path.join(folder, "identities")
    run(linegate, "security", "init", identities)
    run(linegate, "security", "issue", identities, "cell", "--role", "gateway")
    run(linegate, "security", "issue", identities, "operator", "--role", "operator")
    plant = example_plant(folder, f"dds: {{security: {os.path.join(identities, 'cell')}}}\n")
    return plant, os.path.join(identities, "operator")


def follow(machine, network, example):
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
    example = Example(folder, network.on_desk(*examples[language]), {**os.environ, **installed.environment})
    machine = Machine(linegated, linegate, plant, network)
    try:
        follow(machine, network, example)
    finally:
        print("\n".join(line for line in example.text().splitlines() if " = " not in line))
        example.process.kill()
        if machine.gateway is not None and machine.gateway.poll() is None:
            machine.kill()
        network.close()


if __name__ == "__main__":
    run_test(test, own_network=True)
