# SPDX-License-Identifier: Apache-2.0
"""Shared by the end-to-end tests: a gateway with its plant as a separate program, and the console that sends it
commands.

A test is a function of a temporary folder and the arguments of its program; it raises Failure, or returns.
"""

import contextlib
import json
import os
import signal
import socket
import subprocess
import sys
import tempfile
import time

PATIENCE = 60  # seconds
SOURCES = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "..")
EDS = os.path.join(SOURCES, "bridges", "sim", "eds")
HELD = []  # sockets whose names reserve DDS domains
INSIDE = "--inside"  # last argument of a program that runs in a separate network namespace


class Failure(Exception):
    """A test failed; the text says why."""


def expect(what, found, wanted):
    """Fails unless found equals wanted."""
    if found != wanted:
        raise Failure(f"{what}: {found}, not {wanted}")


def raised(kind, function, *arguments):
    """The exception of that kind that the function raises."""
    try:
        function(*arguments)
    except kind as error:
        return error
    raise Failure(f"{function} did not raise {kind}")


def until(what, condition):
    """Repeats the condition until its result is true, and returns the result. Fails after PATIENCE."""
    last = time.monotonic() + PATIENCE
    while not (found := condition()):
        if time.monotonic() > last:
            raise Failure(f"not within {PATIENCE} s: {what}")
        time.sleep(0.2)
    return found


def until_none(what, wrong):
    """Waits until wrong() returns an empty list. Fails with what was in it last."""
    left = []

    def are_right():
        left[:] = wrong()
        return not left
    try:
        until(what, are_right)
    except Failure as failure:
        raise Failure(f"{failure}: {left[:20]}") from failure


def own_domain():
    """Returns a DDS domain that no other program of these tests uses until this one ends, even if it is killed. Lower
    numbers are those of tests/dds/own_domain.h."""
    for i in range(30):
        domain = 200 + (os.getpid() + i) % 30
        held = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        try:
            held.bind(f"\0linegate-test-domain-{domain}")  # a name without a file
        except OSError:
            held.close()
            continue
        HELD.append(held)
        return str(domain)
    raise Failure("every DDS domain is in use")


def write(path, text):
    """Writes a file and returns its path."""
    with open(path, "w", encoding="utf-8") as file:
        file.write(text)
    return path


def stop(process):
    """Stops a program with SIGTERM and returns its exit status."""
    process.send_signal(signal.SIGTERM)
    return process.wait(timeout=PATIENCE)


def end(process):
    """Stops a program with SIGTERM. Fails if its exit status is not 0."""
    code = stop(process)
    if code != 0:
        raise Failure(f"a program ended with {code}")


class Console:
    """linegate, with the arguments that select the domain of a test."""

    def __init__(self, linegate, profiles, domain, environment=None):
        self.console = [linegate, "--profile", profiles, "--domain", domain, "--wait", str(PATIENCE)]
        self.environment = environment

    def ask(self, *words):
        """Returns its output and exit status, whatever they are."""
        return subprocess.run([*self.console, *words], env=self.environment, capture_output=True, text=True,
                              timeout=4 * PATIENCE, check=False)

    def command(self, *words, code=0):
        """Returns its output. Fails if its exit status is not `code`."""
        told = self.ask(*words)
        if told.returncode != code:
            raise Failure(f"{words} ended with {told.returncode}, not {code}\n{told.stdout}{told.stderr}")
        return told

    def text(self, *words, code=0):
        """Returns its standard output."""
        return self.command(*words, code=code).stdout

    def json(self, *words, code=0):
        """Returns the document that it prints with --json."""
        return json.loads(self.text("--json", *words, code=code))

    def stream(self, *words):
        """Returns the documents that it prints with --json, one per line."""
        return [json.loads(line) for line in self.text("--json", *words).splitlines()]

    def lines(self):
        """The lines of all gateways, as received by a new subscriber."""
        return self.json("lines")["lines"]

    def await_operational(self, line, count, what="at the start"):
        """Waits until `count` nodes of a line are Operational. what: named in the failure."""
        until(f"{count} nodes of {line} operational, {what}", lambda: any(
            one["line"] == line and one["nodes_operational"] == count for one in self.lines()))


class Plant(Console):
    """A console together with its gateways, whose plants need not name the DDS domain."""

    def __init__(self, linegated, linegate, profiles, domain):
        super().__init__(linegate, profiles, domain)
        self.program, self.options = linegated, ["--dds-domain", domain, "--dds-profile", profiles]

    def gateway(self, plant):
        """Starts a gateway with that file."""
        return subprocess.Popen([self.program, plant, *self.options])

    @contextlib.contextmanager
    def running(self, plant):
        """Runs a gateway with that file for the duration of a block. It must end with status 0."""
        process = self.gateway(plant)
        try:
            yield process
        except BaseException:
            stop(process)
            raise
        end(process)


@contextlib.contextmanager
def simulated(linegate, uri, devices):
    """Runs another program that simulates devices (profiles by node-ID) on a bus for the duration of a block."""
    words = [word for node, profile in devices.items() for word in ("--device", f"{profile}:{node}")]
    process = subprocess.Popen([linegate, "simulate", uri, *words])
    try:
        yield process
    finally:
        process.terminate()


def in_a_network_of_its_own():
    """Restarts this program in a network namespace with multicast on its loopback interface."""
    commands = "ip link set lo up multicast on && ip route add 224.0.0.0/4 dev lo && exec \"$@\""
    as_root = [] if os.getuid() == 0 else ["--map-root-user"]
    os.execvp("unshare", ["unshare", "--net", *as_root, "sh", "-c", commands, "sh", sys.executable, "-B",
                          *sys.argv, INSIDE])


def run_test(test, own_network=False):
    """Runs a test in a temporary folder, with the arguments of the program, and ends this program with its result."""
    arguments = sys.argv[1:]
    if own_network:
        if arguments[-1:] != [INSIDE]:
            in_a_network_of_its_own()
        arguments = arguments[:-1]
    with tempfile.TemporaryDirectory() as folder:
        try:
            test(folder, *arguments)
        except Failure as failure:
            sys.exit(str(failure))
