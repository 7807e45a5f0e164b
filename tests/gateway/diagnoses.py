#!/usr/bin/python3
"""A plant in which four things are wrong: a mandatory node that is missing, one that is another device than expected,
one that refuses an entry of its configuration, one whose heartbeat is silent. Each is named exactly, in what DDS carries
(NodeState, LineState, events, the line's own objects) and in what the console prints; the fifth node is in order.

diagnoses.py LINEGATED LINEGATE PROFILES
"""

import json
import os
import re
import signal
import subprocess
import sys
import tempfile
import time

PATIENCE = 60  # seconds
EDS = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "bridges", "sim", "eds")
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
# Letter and words of NodeState; event, and what its text has to say.
WRONG = {
    5: ("B", "no answer to the SDO upload of 1000h", "boot-result", r"node 5 \(gate\): boot failed \(B\): no answer.*1000:00.*05040000h"),
    6: ("O", "serial number differs from the expected one", "boot-result",
        r"node 6 \(spindle\): boot failed \(O\): serial number .*1018:04 is 00001006h, not 00001267h"),
    7: ("J", "configuration failed", "configuration-error", r"node 7 \(axis\): .*6083.*too (high|great).*06090031"),
    8: ("K", "no heartbeat after the node was configured", "boot-result",
        r"node 8 \(valves\): boot failed \(K\): no heartbeat"),
}
OPTIONAL_IDENTITY, LIST_CHANGED, CONFIGURATION = 1 << 4, 1 << 7, 1 << 10  # 5F00h:1


class Failure(Exception):
    pass


def console(program, domain, profiles):
    def run(*words):
        told = subprocess.run([program, "--profile", profiles, "--domain", domain, "--wait", str(PATIENCE), *words],
                              capture_output=True, text=True, timeout=4 * PATIENCE)
        if told.returncode != 0:
            raise Failure(f"{words} ended with {told.returncode}\n{told.stdout}{told.stderr}")
        return told.stdout
    return run


def until(what, condition):
    end = time.monotonic() + PATIENCE
    while True:
        found = condition()
        if found:
            return found
        if time.monotonic() > end:
            raise Failure(f"not within {PATIENCE} s: {what}")
        time.sleep(0.2)


def diagnosed(run):
    """NodeState by node-ID, when all boots have come to an end."""
    nodes = {node["node"]: node for node in json.loads(run("--json", "nodes", "press"))}
    done = all(nodes.get(node, {}).get("boot") == wrong[0] for node, wrong in WRONG.items())
    return nodes if done and nodes.get(9, {}).get("boot_text") == "booted" else None


def check_nodes(run):
    nodes = until("four letters", lambda: diagnosed(run))
    for node, (letter, words, _, _) in WRONG.items():
        if not nodes[node]["boot_text"].startswith(words):
            raise Failure(f"node {node}: {nodes[node]['boot_text']}, not {words}")
        if nodes[node]["state"] == "operational":
            raise Failure(f"node {node} is operational")
    table = run("nodes", "press").splitlines()
    for node, (letter, *_) in WRONG.items():
        row = [line.split() for line in table if nodes[node]["name"] in line.split()]
        if len(row) != 1 or letter not in row[0]:
            raise Failure(f"no letter {letter} for node {node} in\n" + "\n".join(table))


def check_events(run):
    lines = json.loads(run("--json", "lines"))["lines"]
    count = lines[0]["counters"]["events"]
    kept = [json.loads(line) for line in run("--json", "events", "press", "-n", str(count)).splitlines()]
    printed = run("events", "press", "-n", str(count))
    for node, (_, _, kind, words) in WRONG.items():
        texts = [event["text"] for event in kept if event["kind"] == kind and event["node"] == node]
        if not any(re.search(words, text) for text in texts):
            raise Failure(f"no {kind} of node {node} that says {words}: {texts}")
        if not re.search(words, printed):
            raise Failure(f"the console does not print {words}:\n{printed}")


def check_line(run):
    line = json.loads(run("--json", "lines"))["lines"][0]
    if line["manager"] != "missing-mandatory" or line["properties"]["ixxat_state"] != "0x70 missing-mandatory":
        raise Failure(f"the line says {line['manager']}, {line['properties']}")
    faulty = int(run("sdo", "read", "press:own", "5F03", "1", "u32"))
    if faulty != sum(1 << (node - 1) for node in WRONG):
        raise Failure(f"5F03h:1 is {faulty:08X}h")
    happened = int(run("sdo", "read", "press:own", "5F00", "1", "u16"))
    if happened != OPTIONAL_IDENTITY | LIST_CHANGED | CONFIGURATION:
        raise Failure(f"5F00h:1 is {happened:04X}h")


def main(linegated, linegate, profiles):
    domain = "231"  # nobody else's of tests/gateway
    with tempfile.TemporaryDirectory() as folder:
        plant = os.path.join(folder, "plant.yaml")
        with open(plant, "w", encoding="utf-8") as file:
            file.write(PLANT)
        gateway = subprocess.Popen([linegated, plant, "--dds-domain", domain, "--dds-profile", profiles])
        try:
            run = console(linegate, domain, profiles)
            check_nodes(run)
            check_events(run)
            check_line(run)
        except Failure as failure:
            return str(failure)
        finally:
            gateway.send_signal(signal.SIGTERM)
            gateway.wait(timeout=PATIENCE)
    return None


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
