# SPDX-License-Identifier: Apache-2.0
"""What the scenarios are written with: programs that run meanwhile, witnesses on the bus, and waiting."""

import argparse
import json
import os
import re
import signal
import subprocess
import sys
import time

FOLDER = os.environ["TMPDIR"]
PATIENCE = 60  # seconds, of which a guest on a machine that has nothing else to do needs few


class Failed(Exception):
    """Something was not as it must be."""


def eventually(what, condition, within=PATIENCE):
    """Asks condition() until it gives something true, and returns that; Failed after `within` seconds."""
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
    """A program that runs in the background; what it prints is in `text()`."""

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
        """As a power cut would: no good-bye."""
        self.process.kill()
        self.process.wait()

    def stop(self, within=PATIENCE):
        """Asks it to end and returns its status."""
        self.process.send_signal(signal.SIGTERM)
        try:
            return self.process.wait(timeout=within)
        except subprocess.TimeoutExpired:
            raise Failed(f"{self.name} did not end within {within} s of SIGTERM") from None


class Witness(Actor):
    """candump on one interface: what was really on the bus."""

    LAST = 0x7FF  # of no service
    LINE = re.compile(r"\(([0-9.]+)\) \S+ ([0-9A-F]+)#([0-9A-F]*)$")

    def __init__(self, interface, filters=None):
        super().__init__(f"candump-{interface}", "candump", "-L", filters or interface)
        listening = re.compile(rf"^ *{interface} ", re.MULTILINE)
        eventually(f"a witness on {interface}", lambda: listening.search(read("/proc/net/can/rcvlist_all")))

    def frames(self, identifier=None):
        """[(time, identifier, data)] so far, of one identifier or all."""
        found = []
        for line in self.text().splitlines():
            match = self.LINE.match(line)
            if match and identifier in (None, int(match[2], 16)):
                found.append((float(match[1]), int(match[2], 16), bytes.fromhex(match[3])))
        return found

    def boot_ups(self, node):
        """How many there were of that node. A heartbeat that is written down late is none of them."""
        return [data for _, _, data in self.frames(0x700 + node)].count(b"\0")

    def await_frame(self, identifier, data):
        """It is written down somewhat later than others hear it."""
        eventually(
            f"the witness saw {identifier:X}#{data.hex()}",
            lambda: data in [seen for _, _, seen in self.frames(identifier)],
        )

    def catch_up(self, interface):
        """Has it write down all that was on the bus until now: what comes behind it is there, too."""
        so_far = len(self.frames(self.LAST))
        send(interface, f"{self.LAST:03X}#")
        eventually("the witness has written everything down", lambda: len(self.frames(self.LAST)) > so_far)


class Site:
    """What a scenario runs on: the programs that its command line names, and the console that asks its gateways."""

    def __init__(self, *others):
        parser = argparse.ArgumentParser()
        for program in ("linegated", "linegate", *others):
            parser.add_argument(f"--{program}", required=True)
        self.programs = parser.parse_args()

    def console(self, *arguments):
        return (self.programs.linegate, "--wait", "60", "--timeout", "20", *arguments)

    def command(self, *arguments):
        """A console command that must be carried out: the JSON it printed."""
        return ask(*self.console("--json", *arguments), within=2 * PATIENCE)

    def refused(self, *arguments):
        """A console command that must be refused: what it said."""
        status, text = run(*self.console(*arguments), within=2 * PATIENCE)
        if status != 1:
            raise Failed(f"{arguments} ended with {status}, not 1: {text}")
        return text

    def held_back(self, *arguments):
        """A write or command that is taken and not sent yet: what it waits for."""
        status, text = run(*self.console(*arguments), within=2 * PATIENCE)
        if status != 4:
            raise Failed(f"{arguments} ended with {status}, not 4: {text}")
        return text

    def gateway(self, name, plant):
        """One with that plant."""
        return Actor(name, self.programs.linegated, write_file(f"{name}.yaml", plant))


def write_file(name, text):
    """A file of the scenario; its path."""
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
    """Runs a program to its end: (status, what it printed)."""
    done = subprocess.run(
        command, stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=within, check=False
    )
    return done.returncode, done.stdout + done.stderr


def ask(*command, within=PATIENCE):
    """Runs a program that must end well and print JSON."""
    status, text = run(*command, within=within)
    if status != 0:
        raise Failed(f"{' '.join(command)} ended with {status}: {text}")
    return json.loads(text)


def play(scenario):
    """Runs a scenario, then ends all actors; when it failed, shows what each of them said."""
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
