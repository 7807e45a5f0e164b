#!/usr/bin/python3
"""LSS from plant.yaml to linegate: devices that begin without a node-ID are given that of the configuration before their
line boots; on a line that does not do so by itself a person finds them, names them and has the rest assigned.

lss.py LINEGATED LINEGATE PROFILES
"""

import json
import os
import signal
import subprocess
import sys
import tempfile
import time

PATIENCE = 60  # seconds
EDS = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "bridges", "sim", "eds")
DOMAIN = "230"  # nobody else's of tests/gateway
PLANT = f"""schema: 1
gateway: {{name: lss}}
lines:
  - name: auto
    interface: "simulated:"
    bit_rate: 1Mbit
    access: all
    lss: {{assign: true, store: true}}
    simulate:
      - {{node: 5, profile: drive, unconfigured: true, serial: 501}}
      - {{node: 6, profile: encoder, unconfigured: true}}
      - {{node: 7, profile: digital-io}}
    nodes:
      - {{id: 5, eds: {EDS}/drive.eds, serial: 501}}
      - {{id: 6, eds: {EDS}/encoder.eds}}
      - {{id: 7, eds: {EDS}/digital-io.eds}}
  - name: hand
    interface: "simulated:"
    bit_rate: 1Mbit
    access: all
    simulate:
      - {{node: 5, profile: drive, unconfigured: true, serial: 501}}
      - {{node: 6, profile: encoder, unconfigured: true, serial: 601}}
    nodes:
      - {{id: 5, eds: {EDS}/drive.eds, serial: 501}}
      - {{id: 6, eds: {EDS}/encoder.eds}}
"""
DRIVE = "4C47:4020:10000:1F5"
ENCODER = "4C47:4060:10000:259"


class Failure(Exception):
    pass


class Console:
    def __init__(self, linegate, profiles):
        self.command = [linegate, "--profile", profiles, "--domain", DOMAIN, "--wait", str(PATIENCE)]

    def run(self, *words, code=0):
        told = subprocess.run([*self.command, *words], capture_output=True, text=True, timeout=4 * PATIENCE)
        if told.returncode != code:
            raise Failure(f"{words} ended with {told.returncode}, not {code}\n{told.stdout}{told.stderr}")
        return told.stdout

    def json(self, *words, code=0):
        return json.loads(self.run("--json", *words, code=code))

    def operational(self, line):
        return {node["node"] for node in self.json("nodes", line) if node["state"] == "operational"}

    def until_operational(self, line, nodes):
        end = time.monotonic() + PATIENCE
        while self.operational(line) != nodes:
            if time.monotonic() > end:
                raise Failure(f"not within {PATIENCE} s: nodes {nodes} of {line} operational")
            time.sleep(0.2)


def expect(what, got, wanted):
    if got != wanted:
        raise Failure(f"{what}: {got}, not {wanted}")


def assigned_before_boot(console):
    console.until_operational("auto", {5, 6, 7})
    events = [json.loads(line) for line in console.run("--json", "events", "auto", "-n", "14").splitlines()]
    given = {event["node"]: event["number"] for event in events if event["kind"] == "lss-result"}
    expect("node-IDs were given to", set(given), {5, 6})
    begun = min(event["number"] for event in events if event["kind"] == "manager-state")
    if max(given.values()) > begun:
        raise Failure(f"given as {given}, but the network began to boot at {begun}")
    expect("the drive is", console.json("lss", "auto", "inquire", DRIVE)["node"], 5)


def by_hand(console):
    expect("unconfigured", console.json("lss", "hand", "identify")["unconfigured"], True)
    found = console.run("lss", "hand", "scan").split()
    expect("found", sorted(found), sorted([DRIVE, ENCODER]))
    expect("inquired", console.run("lss", "hand", "inquire", DRIVE), f"{DRIVE} without a node-ID\n")
    console.run("lss", "hand", "set-node-id", "5", DRIVE, "--store")
    console.until_operational("hand", {5})
    console.run("lss", "hand", "bit-timing", "250", DRIVE)
    console.run("lss", "hand", "set-node-id", "5", code=2)  # which device?
    console.run("lss", "hand", "inquire", "1:2:3:4", code=1)  # nobody
    devices = console.json("lss", "hand", "assign")["devices"]
    expect("assigned", [(device["node"], device["result"], device["serial"]) for device in devices], [(6, 0, 601)])
    console.until_operational("hand", {5, 6})
    expect("assigned again", console.json("lss", "hand", "assign")["devices"], [])


def main(linegated, linegate, profiles):
    with tempfile.TemporaryDirectory() as folder:
        plant = os.path.join(folder, "plant.yaml")
        with open(plant, "w", encoding="utf-8") as file:
            file.write(PLANT)
        gateway = subprocess.Popen([linegated, plant, "--dds-domain", DOMAIN, "--dds-profile", profiles])
        try:
            console = Console(linegate, profiles)
            assigned_before_boot(console)
            by_hand(console)
        except Failure as failure:
            return str(failure)
        finally:
            gateway.send_signal(signal.SIGTERM)
            code = gateway.wait(timeout=PATIENCE)
        return None if code == 0 else f"linegated ended with {code}"


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
