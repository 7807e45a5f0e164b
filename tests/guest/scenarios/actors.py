"""What the scenarios are written with: programs that run meanwhile, witnesses on the bus, and waiting."""

import json
import os
import re
import signal
import subprocess
import sys
import time

FOLDER = os.environ["TMPDIR"]


class Failed(Exception):
    """Something was not as it must be."""


def eventually(what, condition, within):
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

    def stop(self, within=10):
        """Asks it to end and returns its status."""
        self.process.send_signal(signal.SIGTERM)
        try:
            return self.process.wait(timeout=within)
        except subprocess.TimeoutExpired:
            raise Failed(f"{self.name} did not end within {within} s of SIGTERM") from None


class Witness(Actor):
    """candump on one interface: what was really on the bus."""

    LINE = re.compile(r"\(([0-9.]+)\) \S+ ([0-9A-F]+)#([0-9A-F]*)$")

    def __init__(self, interface, filters=None):
        super().__init__(f"candump-{interface}", "candump", "-L", filters or interface)
        listening = re.compile(rf"^ *{interface} ", re.MULTILINE)
        eventually(
            f"a witness on {interface}", lambda: listening.search(read("/proc/net/can/rcvlist_all")), 5
        )

    def frames(self, identifier=None):
        """[(time, identifier, data)] so far, of one identifier or all."""
        found = []
        for line in self.text().splitlines():
            match = self.LINE.match(line)
            if match and identifier in (None, int(match[2], 16)):
                found.append((float(match[1]), int(match[2], 16), bytes.fromhex(match[3])))
        return found


def read(path):
    with open(path, encoding="utf-8") as file:
        return file.read()


def send(interface, frame):
    subprocess.run(["cansend", interface, frame], check=True)


def run(*command, within=20):
    """Runs a program to its end: (status, what it printed)."""
    done = subprocess.run(
        command, stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=within, check=False
    )
    return done.returncode, done.stdout + done.stderr


def ask(*command, within=20):
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
    except (Failed, subprocess.SubprocessError, json.JSONDecodeError) as failure:
        status = 1
        print(f"FAILED: {failure}")
        for actor in Actor.everyone:
            print(f"--- {actor.name}, last lines:")
            print("\n".join(line[:160] for line in actor.text().splitlines()[-40:]))
    finally:
        for actor in Actor.everyone:
            if actor.runs():
                actor.kill()
    sys.exit(status)
