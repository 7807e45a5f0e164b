# SPDX-License-Identifier: Apache-2.0
"""Hosts of a network as network namespaces, for tests with root's rights in their own user namespace or as root.

Each host is a process that holds its namespaces. Cables are veth pairs, so each test makes the fault that it needs: no
cable, no multicast, no address, or a firewall (firewall.py) between two hosts."""

import itertools
import os
import subprocess
import sys
import time

from plant_process import Failure, until

FOLDER = os.path.dirname(os.path.abspath(__file__))
CABLES = itertools.count()


def run(*words):
    """Runs a command of the system. Fails if it does."""
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise Failure(f"{' '.join(words)}: {done.stderr}")


class Host:
    """A host without interfaces but loopback, on which multicast is off, as usual."""

    def __init__(self, name):
        self.name = name
        self.keeper = subprocess.Popen(["unshare", "--net", "--uts", "sleep", "infinity"])
        self.programs = []
        own = os.readlink("/proc/self/ns/net")
        while self.keeper.poll() is None and self.namespace() in (own, None):
            time.sleep(0.01)
        self.run("hostname", name)
        self.run("ip", "link", "set", "lo", "up")

    def namespace(self):
        """The identity of its namespace; None while it is made."""
        try:
            return os.readlink(f"/proc/{self.keeper.pid}/ns/net")
        except OSError:
            return None

    def words(self, *words):
        """The command that runs these words on the host."""
        return ["nsenter", "--target", str(self.keeper.pid), "--net", "--uts", *words]

    def run(self, *words):
        """Runs a command of the system there."""
        run(*self.words(*words))

    def start(self, *words, **options):
        """Starts a program that ends with the host at the latest."""
        program = subprocess.Popen(self.words(*words), **options)
        self.programs.append(program)
        return program

    def end(self, program):
        """Ends a program."""
        program.terminate()
        program.wait()
        self.programs.remove(program)

    def address(self, address, interface="eth0"):
        """Gives an interface an address, and brings it up."""
        self.run("ip", "address", "add", address, "dev", interface)
        self.run("ip", "link", "set", interface, "up")

    def is_ready(self):
        """Whether each interface that is up carries frames."""
        links = subprocess.run(self.words("ip", "-brief", "link", "show", "up"), capture_output=True, text=True,
                               check=True).stdout.splitlines()
        return all(link.split()[1] == "UP" for link in links if not link.startswith("lo "))

    def close(self):
        """Ends its programs and the host."""
        for program in self.programs:
            program.kill()
            program.wait()
        self.keeper.kill()
        self.keeper.wait()


def cable(one, other, names=("eth0", "eth0")):
    """Connects two hosts."""
    ends = [f"cable{next(CABLES)}" for _ in names]
    run("ip", "link", "add", ends[0], "type", "veth", "peer", "name", ends[1])
    for end, host, name in zip(ends, (one, other), names):
        run("ip", "link", "set", end, "netns", str(host.keeper.pid))
        host.run("ip", "link", "set", end, "name", name)


def await_ready(*hosts):
    """Waits until the cables of the hosts carry frames: programs leave out an interface that does not when they start."""
    until("the cables carry frames", lambda: all(host.is_ready() for host in hosts))


def firewall(between, one, other, rule):
    """Connects two hosts by a third one, which passes frames on unless the rule drops them (firewall.py)."""
    cable(one, between, ("eth0", "port0"))
    cable(other, between, ("eth0", "port1"))
    for port in ("port0", "port1"):
        between.run("ip", "link", "set", port, "up", "promisc", "on")
    for host in (one, other):
        host.run(sys.executable, "-B", os.path.join(FOLDER, "firewall.py"), "--checksums", "eth0")
    program = between.start(sys.executable, "-B", os.path.join(FOLDER, "firewall.py"), "port0", "port1", rule,
                            stdout=subprocess.PIPE, text=True)
    if program.stdout.readline() != "ready\n":
        raise Failure("the firewall did not start")
