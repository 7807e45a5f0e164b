#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""A plant with four faults: a mandatory node that is missing, one that is another device than expected, one that
rejects an entry of its configuration, one without a heartbeat. Each is reported exactly, in the samples on DDS
(NodeState, LineState, events, the line's own objects) and in the output of the console; the fifth node has no fault.

diagnoses.py LINEGATED LINEGATE PROFILES
"""

import os
import re

from plant_process import EDS, Failure, Plant, run_test, stop, until, write

DOMAIN = "231"  # used by no other test of tests/gateway
PLANT = f"""schema: 1
gateway: {{name: diagnosed}}
lines:
  - name: press
    interface: "simulated:"
    heartbeat: 1s
    access: all
    nodes:
      - {{id: 5, name: gate, eds: {EDS}/digital-io.eds, mandatory: true, boot_timeout: 2s}}
      - {{id: 6, name: spindle, eds: {EDS}/encoder.eds, serial: 4711, heartbeat: 200ms}}
      - {{id: 7, name: axis, eds: {EDS}/drive.eds, heartbeat: 200ms, objects: {{"6083:0": 2000000000}}}}
      - {{id: 8, name: valves, eds: {EDS}/digital-io.eds, heartbeat: {{consumer: 300ms}}}}
      - {{id: 9, name: lamps, eds: {EDS}/digital-io.eds, heartbeat: 200ms}}
    simulate:
      - {{node: 6, profile: encoder}}
      - {{node: 7, profile: drive}}
      - {{node: 8, profile: digital-io}}
      - {{node: 9, profile: digital-io}}
"""
# Letter and words of NodeState; event, and a text that it must contain.
WRONG = {
    5: ("B", "no answer to the SDO upload of 1000h", "boot-result", r"node 5 \(gate\): boot failed \(B\): no answer.*1000:00.*05040000h"),
    6: ("O", "serial number differs from the expected one", "boot-result",
        r"node 6 \(spindle\): boot failed \(O\): serial number .*1018:04 is 00001006h, not 00001267h"),
    7: ("J", "configuration failed", "configuration-error", r"node 7 \(axis\): .*6083.*too (high|great).*06090031"),
    8: ("K", "no heartbeat after the node was configured", "boot-result",
        r"node 8 \(valves\): boot failed \(K\): no heartbeat"),
}
OPTIONAL_IDENTITY, LIST_CHANGED, CONFIGURATION = 1 << 4, 1 << 7, 1 << 10  # 5F00h:1


def diagnosed(plant):
    """Returns NodeState by node-ID, when all boot processes have ended."""
    nodes = {node["node"]: node for node in plant.json("nodes", "press")}
    done = all(nodes.get(node, {}).get("boot") == wrong[0] for node, wrong in WRONG.items())
    return nodes if done and nodes.get(9, {}).get("boot_text") == "booted" else None


def check_nodes(plant):
    nodes = until("four letters", lambda: diagnosed(plant))
    for node, (letter, words, _, _) in WRONG.items():
        if not nodes[node]["boot_text"].startswith(words):
            raise Failure(f"node {node}: {nodes[node]['boot_text']}, not {words}")
        if nodes[node]["state"] == "operational":
            raise Failure(f"node {node} is operational")
    table = plant.text("nodes", "press").splitlines()
    for node, (letter, *_) in WRONG.items():
        row = [line.split() for line in table if nodes[node]["name"] in line.split()]
        if len(row) != 1 or letter not in row[0]:
            raise Failure(f"no letter {letter} for node {node} in\n" + "\n".join(table))


def check_events(plant):
    count = plant.lines()[0]["counters"]["events"]
    kept = plant.stream("events", "press", "-n", str(count))
    printed = plant.text("events", "press", "-n", str(count))
    for node, (_, _, kind, words) in WRONG.items():
        texts = [event["text"] for event in kept if event["kind"] == kind and event["node"] == node]
        if not any(re.search(words, text) for text in texts):
            raise Failure(f"no {kind} of node {node} that says {words}: {texts}")
        if not re.search(words, printed):
            raise Failure(f"the console does not print {words}:\n{printed}")


def check_line(plant):
    line = plant.lines()[0]
    if line["manager"] != "missing-mandatory" or line["properties"]["ixxat_state"] != "0x70 missing-mandatory":
        raise Failure(f"the line says {line['manager']}, {line['properties']}")
    faulty = int(plant.text("sdo", "read", "press:own", "5F03", "1", "u32"))
    if faulty != sum(1 << (node - 1) for node in WRONG):
        raise Failure(f"5F03h:1 is {faulty:08X}h")
    happened = int(plant.text("sdo", "read", "press:own", "5F00", "1", "u16"))
    if happened != OPTIONAL_IDENTITY | LIST_CHANGED | CONFIGURATION:
        raise Failure(f"5F00h:1 is {happened:04X}h")


def file_without_limits(folder):
    """Writes the drive's device file without limits, like some tools: a check cannot detect that the value is too
    high."""
    with open(os.path.join(EDS, "drive.eds"), encoding="latin-1") as file:
        lines = [line for line in file if not line.startswith(("LowLimit", "HighLimit"))]
    return write(os.path.join(folder, "drive.eds"), "".join(lines))


def test(folder, linegated, linegate, profiles):
    plant = Plant(linegated, linegate, profiles, DOMAIN)
    text = PLANT.replace(f"{EDS}/drive.eds", file_without_limits(folder))
    gateway = plant.gateway(write(os.path.join(folder, "plant.yaml"), text))
    try:
        check_nodes(plant)
        check_events(plant)
        check_line(plant)
    finally:
        stop(gateway)


if __name__ == "__main__":
    run_test(test)
