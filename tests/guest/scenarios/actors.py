# SPDX-License-Identifier: Apache-2.0
"""Shared by the scenarios: programs in the background, recordings of the bus, and waiting with a deadline."""

import argparse
import json
import os
import re
import signal
import subprocess
import sys
import time

FOLDER = os.environ["TMPDIR"]
PATIENCE = 180  # seconds; a guest on an idle machine needs only a few, one on a busy machine up to a minute

# The gateway may take longer for its end: otherwise it ends with 70 after 5 s, which is too short in a guest on a busy machine.
LAST_WORDS = ("--last-words", "30")


class Failed(Exception):
    """An expectation of a scenario failed."""


def eventually(what, condition, within=PATIENCE):
    """Calls condition() until its result is true, and returns the result. Raises Failed after `within` seconds."""
    end = time.monotonic() + within
    while True:
        got = condition()
        if got:
            print(f"ok: {what}", flush=True)
            return got
        if time.monotonic() > end:
            raise Failed(f"not within {within} s: {what}")
        time.sleep(0.1)


def check(what, condition):
    if not condition:
        raise Failed(what)
    print(f"ok: {what}", flush=True)


class Actor:
    """A program that runs in the background; `text()` returns its output."""

    everyone = []

    def __init__(self, name, *command, environment=None):
        self.name = name
        self.path = os.path.join(FOLDER, f"{len(Actor.everyone)}.log")
        with open(self.path, "wb") as log:
            self.process = subprocess.Popen(
                command,
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=subprocess.STDOUT,
                env={**os.environ, **(environment or {})},
            )
        Actor.everyone.append(self)

    def text(self):
        with open(self.path, encoding="utf-8", errors="replace") as log:
            return log.read()

    def runs(self):
        return self.process.poll() is None

    def kill(self):
        """Kills it, like a power cut."""
        self.process.kill()
        self.process.wait()

    def stop(self, within=PATIENCE):
        """Requests its end and returns its exit status."""
        self.process.send_signal(signal.SIGTERM)
        try:
            return self.process.wait(timeout=within)
        except subprocess.TimeoutExpired:
            raise Failed(f"{self.name} did not end within {within} s of SIGTERM") from None


class Witness(Actor):
    """candump on one interface: a record of the frames on the bus."""

    LAST = 0x7FF  # an identifier that no CANopen service uses
    LINE = re.compile(r"\(([0-9.]+)\) \S+ ([0-9A-F]+)#([0-9A-F]*)$")

    def __init__(self, interface, filters=None):
        super().__init__(f"candump-{interface}", "candump", "-L", filters or interface)
        listening = re.compile(rf"^ *{interface} ", re.MULTILINE)
        eventually(f"a witness on {interface}", lambda: listening.search(read("/proc/net/can/rcvlist_all")))

    def frames(self, identifier=None):
        """Returns [(time, identifier, data)] so far, of one identifier or all."""
        found = []
        for line in self.text().splitlines():
            match = self.LINE.match(line)
            if match and identifier in (None, int(match[2], 16)):
                found.append((float(match[1]), int(match[2], 16), bytes.fromhex(match[3])))
        return found

    def boot_ups(self, node):
        """Returns the number of boot-up messages of that node. Heartbeats do not count."""
        return [data for _, _, data in self.frames(0x700 + node)].count(b"\0")

    def await_frame(self, identifier, data):
        """Waits for a frame. candump may print it somewhat later than other programs receive it."""
        eventually(
            f"the witness saw {identifier:X}#{data.hex()}",
            lambda: data in [seen for _, _, seen in self.frames(identifier)],
        )

    def catch_up(self, interface):
        """Waits until all frames on the bus so far are recorded: sends a frame and waits for it."""
        so_far = len(self.frames(self.LAST))
        send(interface, f"{self.LAST:03X}#")
        eventually("the witness has written everything down", lambda: len(self.frames(self.LAST)) > so_far)


class Site:
    """The environment of a scenario: the programs that its command line names, and the console for its gateways."""

    def __init__(self, *others):
        parser = argparse.ArgumentParser()
        for program in ("linegated", "linegate", *others):
            parser.add_argument(f"--{program}", required=True)
        self.programs = parser.parse_args()

    def console(self, *arguments):
        return (self.programs.linegate, "--wait", str(PATIENCE), "--timeout", "120", *arguments)

    def command(self, *arguments):
        """Runs a console command that must succeed, and returns the JSON that it printed."""
        return ask(*self.console("--json", *arguments), within=2 * PATIENCE)

    def refused(self, *arguments):
        """Runs a console command that must be rejected, and returns its error message."""
        status, text = run(*self.console(*arguments), within=2 * PATIENCE)
        if status != 1:
            raise Failed(f"{arguments} ended with {status}, not 1: {text}")
        return text

    def held_back(self, *arguments):
        """Runs a write or command that is accepted but not sent yet, and returns what it waits for."""
        status, text = run(*self.console(*arguments), within=2 * PATIENCE)
        if status != 4:
            raise Failed(f"{arguments} ended with {status}, not 4: {text}")
        return text

    def gateway(self, name, plant):
        """Starts a gateway with that plant."""
        return Actor(name, self.programs.linegated, *LAST_WORDS, write_file(f"{name}.yaml", plant))


def write_file(name, text):
    """Writes a file of the scenario and returns its path."""
    path = os.path.join(FOLDER, name)
    with open(path, "w", encoding="utf-8") as file:
        file.write(text)
    return path


def read(path):
    with open(path, encoding="utf-8") as file:
        return file.read()


def send(interface, frame):
    subprocess.run(["cansend", interface, frame], check=True)


def run(*command, within=PATIENCE):
    """Runs a program to its end and returns (status, output)."""
    done = subprocess.run(
        command, stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=within, check=False
    )
    return done.returncode, done.stdout + done.stderr


def ask(*command, within=PATIENCE):
    """Runs a program that must exit with 0, and returns the JSON that it printed."""
    status, text = run(*command, within=within)
    if status != 0:
        raise Failed(f"{' '.join(command)} ended with {status}: {text}")
    return json.loads(text)


def play(scenario):
    """Runs a scenario, then ends all actors; if it failed, prints the output of each of them."""
    status = 0
    try:
        scenario()
    except (Failed, ValueError, LookupError, OSError, subprocess.SubprocessError) as failure:
        status = 1
        print(f"FAILED: {failure!r}")
        for actor in Actor.everyone:
            print(f"--- {actor.name}, last lines:")
            print("\n".join(line[:160] for line in actor.text().splitlines()[-40:]))
    finally:
        for actor in Actor.everyone:
            if actor.runs():
                actor.kill()
    sys.exit(status)
