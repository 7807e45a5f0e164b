#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""LSS from plant.yaml to linegate: devices that start without a node-ID get the configured one before their line
boots; on a line without automatic assignment, a user finds them, assigns node-IDs to some, and has the rest
assigned.

lss.py LINEGATED LINEGATE PROFILES
"""

import os

from plant_process import EDS, Failure, Plant, expect, run_test, until, write

DOMAIN = "230"  # used by no other test of tests/gateway
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


class Lines(Plant):
    def operational(self, line):
        return {node["node"] for node in self.json("nodes", line) if node["state"] == "operational"}

    def until_operational(self, line, nodes):
        until(f"nodes {nodes} of {line} operational", lambda: self.operational(line) == nodes)


def assigned_before_boot(plant):
    plant.until_operational("auto", {5, 6, 7})
    events = plant.stream("events", "auto", "--once")
    given = {event["node"]: event["number"] for event in events if event["kind"] == "lss-result"}
    expect("node-IDs were given to", set(given), {5, 6})
    begun = min(event["number"] for event in events if event["kind"] == "manager-state")
    if max(given.values()) > begun:
        raise Failure(f"given as {given}, but the network began to boot at {begun}")
    expect("the drive is", plant.json("lss", "auto", "inquire", DRIVE)["node"], 5)


def by_hand(plant):
    expect("unconfigured", plant.json("lss", "hand", "identify")["unconfigured"], True)
    found = plant.text("lss", "hand", "scan").split()
    expect("found", sorted(found), sorted([DRIVE, ENCODER]))
    expect("inquired", plant.text("lss", "hand", "inquire", DRIVE), f"{DRIVE} without a node-ID\n")
    plant.command("lss", "hand", "set-node-id", "5", DRIVE, "--store")
    plant.until_operational("hand", {5})
    plant.command("lss", "hand", "bit-timing", "250", DRIVE)
    plant.command("lss", "hand", "set-node-id", "5", code=2)  # the device is not specified
    plant.command("lss", "hand", "inquire", "1:2:3:4", code=1)  # no such device
    devices = plant.json("lss", "hand", "assign")["devices"]
    expect("assigned", [(device["node"], device["result"], device["serial"]) for device in devices], [(6, 0, 601)])
    plant.until_operational("hand", {5, 6})
    expect("assigned again", plant.json("lss", "hand", "assign")["devices"], [])


def test(folder, linegated, linegate, profiles):
    plant = Lines(linegated, linegate, profiles, DOMAIN)
    with plant.running(write(os.path.join(folder, "plant.yaml"), PLANT)):
        assigned_before_boot(plant)
        by_hand(plant)


if __name__ == "__main__":
    run_test(test)
