#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""linegate boot and linegate nodes: a plant with a mandatory node that is missing, one with a wrong identity, one
that rejects an entry of its configuration and one without a heartbeat yields four exact diagnoses.

boot.py LINEGATED LINEGATE PROFILES. The line is simulated inside the gateway, in a separate network namespace.
"""

import json
import os
import time

from plant_process import EDS, Failure, Plant, expect, run_test, stop, write

PLANT = f"""schema: 1
gateway: {{name: boot}}
lines:
  - name: press
    interface: "simulated:"
    access: all
    startup: {{own_start: true}}
    nodes:
      - {{id: 4, name: good, eds: {EDS}/encoder.eds, heartbeat: 200ms}}
      - {{id: 5, name: gone, eds: {EDS}/drive.eds, mandatory: true, boot_timeout: 2s}}
      - {{id: 6, name: other, eds: {EDS}/encoder.eds, serial: 4711}}
      - {{id: 7, name: stubborn, eds: {EDS}/encoder.eds, objects: {{1005: 0x00000001}}}}
      - {{id: 8, name: silent, eds: {EDS}/encoder.eds, heartbeat: {{consumer: 300ms}}}}
    simulate:
      - {{node: 4, profile: encoder}}
      - {{node: 6, profile: encoder}}
      - {{node: 7, profile: encoder}}
      - {{node: 8, profile: encoder}}
"""
# The letter, and a text that the message must contain.
WANTED = {
    4: ("", "booted"),
    5: ("B", "1000:00 ended with 05040000h"),
    6: ("O", "1018:04 is 00001006h, not 00001267h"),
    7: ("J", "1005:00 ended with 06090030h"),
    8: ("K", "no heartbeat"),
}


def run(plant):
    told = plant.command("--json", "boot", "press", code=1)
    nodes = {node["node"]: node for node in json.loads(told.stdout)["nodes"]}
    expect("nodes", set(nodes), set(WANTED))
    for node, (letter, words) in WANTED.items():
        expect(f"letter of node {node}", nodes[node]["letter"], letter)
        if words not in nodes[node]["text"]:
            raise Failure(f"node {node}: {nodes[node]['text']}")
        if f"node {node} (" not in told.stderr:
            raise Failure(f"the result of node {node} was not told when it came:\n{told.stderr}")
    expect("expected serial number", nodes[6]["expected"], 4711)
    expect("serial number found", nodes[6]["found"], 0x1006)
    expect("abort code", nodes[5]["abort"], "05040000")

    plant.command("boot", "press:4")  # boots without a failure
    if "4711" in plant.command("boot", "press:6", code=1).stdout:
        raise Failure("values are hexadecimal in words")
    told = plant.command("config", "apply", "press:6", code=1).stdout
    if WANTED[6][1] not in told:
        raise Failure("a configuration for another device:\n" + told)
    told = plant.command("boot", "press:99", code=1).stderr
    if "node 99 is none of press; its nodes: 4 (" not in told:
        raise Failure("a node that is not configured:\n" + told)
    plant.command("boot", "press:own", code=2)

    seen = {node["node"]: node for node in plant.json("nodes", "press")}
    expect("property of NodeState", seen[6]["properties"]["boot-object"], "1018:04")
    expect("property of NodeState", seen[6]["properties"]["boot-expected"], "00001267")
    expect("presence of node 5", seen[5]["presence"], "missing")
    line = plant.lines()[0]
    expect("state of the manager", line["manager"], "missing-mandatory")


def test(folder, linegated, linegate, profiles):
    plant = Plant(linegated, linegate, profiles, "198")
    gateway = plant.gateway(write(os.path.join(folder, "plant.yaml"), PLANT))
    try:
        time.sleep(0.1)
        run(plant)
    finally:
        stop(gateway)


if __name__ == "__main__":
    run_test(test, own_network=True)
