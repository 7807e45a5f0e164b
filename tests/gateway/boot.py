#!/usr/bin/python3
"""linegate boot and linegate nodes: a plant with a mandatory node that is missing, one of wrong identity, one that
refuses an entry of its configuration and one whose heartbeat does not come gives four exact diagnoses.

boot.py LINEGATED LINEGATE PROFILES. The line is simulated inside the gateway, in a network of its own.
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
# Letter and what the words must hold.
WANTED = {
    4: ("", "booted"),
    5: ("B", "1000:00 ended with 05040000h"),
    6: ("O", "1018:04 is 00001006h, not 00001267h"),
    7: ("J", "1005:00 ended with 06090030h"),
    8: ("K", "no heartbeat"),
}


class Failure(Exception):
    pass


class Plant:
    def __init__(self, linegate, profiles):
        self.console = [linegate, "--profile", profiles, "--domain", "198", "--wait", str(PATIENCE)]

    def command(self, *words, code=0):
        told = subprocess.run([*self.console, *words], capture_output=True, text=True, timeout=2 * PATIENCE)
        if told.returncode != code:
            raise Failure(f"{words} ended with {told.returncode}, not {code}\n{told.stdout}{told.stderr}")
        return told

LAST = 5  # is waited for longest


def expect(found, wanted, what):
    if found != wanted:
        raise Failure(f"{what}: {found}, not {wanted}")


def run(plant):
    told = plant.command("--json", "boot", "press", code=1)
    nodes = {node["node"]: node for node in json.loads(told.stdout)["nodes"]}
    expect(set(nodes), set(WANTED), "nodes")
    for node, (letter, words) in WANTED.items():
        expect(nodes[node]["letter"], letter, f"letter of node {node}")
        if words not in nodes[node]["text"]:
            raise Failure(f"node {node}: {nodes[node]['text']}")
        # That of the last comes together with the reply, on another topic.
        if node != LAST and f"node {node} (" not in told.stderr:
            raise Failure(f"the result of node {node} was not told when it came:\n{told.stderr}")
    expect(nodes[6]["expected"], 4711, "expected serial number")
    expect(nodes[6]["found"], 0x1006, "serial number found")
    expect(nodes[5]["abort"], "05040000", "abort code")

    plant.command("boot", "press:4")  # is booted: no failure
    if "4711" in plant.command("boot", "press:6", code=1).stdout:
        raise Failure("values are hexadecimal in words")
    plant.command("boot", "press:own", code=2)

    seen = {node["node"]: node for node in json.loads(plant.command("--json", "nodes", "press").stdout)}
    expect(seen[6]["properties"]["boot-object"], "1018:04", "property of NodeState")
    expect(seen[6]["properties"]["boot-expected"], "00001267", "property of NodeState")
    expect(seen[5]["presence"], "missing", "presence of node 5")
    line = json.loads(plant.command("--json", "lines").stdout)["lines"][0]
    expect(line["manager"], "missing-mandatory", "state of the manager")


def main(linegated, linegate, profiles):
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "plant.yaml")
        with open(path, "w", encoding="utf-8") as file:
            file.write(PLANT)
        gateway = subprocess.Popen([linegated, path, "--dds-domain", "198", "--dds-profile", profiles])
        try:
            time.sleep(0.1)
            run(Plant(linegate, profiles))
        except Failure as failure:
            return str(failure)
        finally:
            gateway.send_signal(signal.SIGTERM)
            gateway.wait(timeout=PATIENCE)
    return None


def in_a_network_of_its_own(arguments):
    commands = "ip link set lo up multicast on && ip route add 224.0.0.0/4 dev lo && exec \"$@\""
    as_root = [] if os.getuid() == 0 else ["--map-root-user"]
    os.execvp("unshare", ["unshare", "--net", *as_root, "sh", "-c", commands, "sh", sys.executable, "-B",
                          *arguments, "--inside"])


if __name__ == "__main__":
    if sys.argv[-1] != "--inside":
        in_a_network_of_its_own(sys.argv)
    sys.exit(main(*sys.argv[1:-1]))
