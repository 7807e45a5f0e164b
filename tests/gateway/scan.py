#!/usr/bin/python3
"""linegate scan: a gateway that knows nothing of the devices on its line finds all of them and writes to none; the
plant that is written out boots on the next start, with the image that the configured plant has.

scan.py LINEGATED LINEGATE PROFILES. The line is a multicast group in a network of its own.
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
URI = "udp:239.74.163.9:43119"
DEVICES = {5: "drive", 7: "encoder", 8: "digital-io", 10: "analog-io"}
HEAD = "schema: 1\ngateway: {name: scan}\n"
LINE = f"""lines:
  - name: press
    interface: "{URI}"
    bit_rate: 1Mbit
"""


class Failure(Exception):
    pass


class Plant:
    def __init__(self, linegated, linegate, profiles):
        self.linegated, self.profiles, self.domain = linegated, profiles, "199"
        self.console = [linegate, "--profile", profiles, "--domain", self.domain, "--wait", str(PATIENCE)]

    def command(self, *words, code=0):
        told = subprocess.run([*self.console, *words], capture_output=True, text=True, timeout=4 * PATIENCE)
        if told.returncode != code:
            raise Failure(f"{words} ended with {told.returncode}, not {code}\n{told.stdout}{told.stderr}")
        return told

    def gateway(self, plant):
        return subprocess.Popen([self.linegated, plant, "--dds-domain", self.domain, "--dds-profile", self.profiles])

    def until(self, what, condition):
        end = time.monotonic() + PATIENCE
        while not condition():
            if time.monotonic() > end:
                raise Failure(f"not within {PATIENCE} s: {what}")
            time.sleep(0.2)

    def operational(self):
        lines = json.loads(self.command("--json", "lines").stdout)["lines"]
        return bool(lines) and lines[0]["nodes_operational"] == len(DEVICES)

    def layouts(self, plant):
        """The layouts of both directions when all nodes of that plant are Operational."""
        process = self.gateway(plant)
        try:
            self.until(f"all nodes of {plant} operational", self.operational)
            return [json.loads(self.command("--json", "image", "press", *which).stdout)["layout_id"]
                    for which in ((), ("--outputs",))]
        finally:
            end(process)


def end(process):
    process.send_signal(signal.SIGTERM)
    if process.wait(timeout=PATIENCE) != 0:
        raise Failure(f"a program ended with {process.returncode}")


def write(path, text):
    with open(path, "w", encoding="utf-8") as file:
        file.write(text)
    return path


def run(plant, folder):
    configured = "".join(f"      - {{id: {node}, eds: {EDS}/{profile}.eds}}\n" for node, profile in DEVICES.items())
    wanted = plant.layouts(write(f"{folder}/configured.yaml", HEAD + LINE + "    nodes:\n" + configured))

    process = plant.gateway(write(f"{folder}/bare.yaml", HEAD + LINE))
    try:
        scanned = plant.command("--json", "scan", "press", "--write", f"{folder}/found", "--eds", EDS)
        nodes = json.loads(scanned.stdout)["nodes"]
        if {node["node"] for node in nodes} != set(DEVICES) or not all(node["complete"] for node in nodes):
            raise Failure("the scan found " + scanned.stdout)
        if scanned.stderr.count("scanned, ") != len(DEVICES):
            raise Failure("the nodes were not told while they were read:\n" + scanned.stderr)
        one = plant.command("scan", "press:8").stdout
        if "heartbeat" not in one and "none" not in one:
            raise Failure("one node alone:\n" + one)
        plant.command("scan", "press", "--write", f"{folder}/found", code=1)  # nothing is overwritten
    finally:
        end(process)
    found = plant.layouts(f"{folder}/found/plant.yaml")
    if found != wanted:
        raise Failure(f"layouts {found} of what was found, {wanted} of what was configured")


def run_simulated(plant, folder):
    """Devices that the gateway simulates itself are part of what is written."""
    simulated = "".join(f"      - {{node: {node}, profile: {profile}}}\n" for node, profile in DEVICES.items())
    line = LINE.replace(URI, "simulated:")
    process = plant.gateway(write(f"{folder}/simulated.yaml", HEAD + line + "    simulate:\n" + simulated))
    try:
        plant.command("scan", "press", "--write", f"{folder}/embedded")
    finally:
        end(process)
    plant.layouts(f"{folder}/embedded/plant.yaml")


def main(linegated, linegate, profiles):
    devices = [word for node, profile in DEVICES.items() for word in ("--device", f"{profile}:{node}")]
    with tempfile.TemporaryDirectory() as folder:
        simulated = subprocess.Popen([linegate, "simulate", URI, *devices])
        try:
            run(Plant(linegated, linegate, profiles), folder)
            run_simulated(Plant(linegated, linegate, profiles), folder)
        except Failure as failure:
            return str(failure)
        finally:
            simulated.terminate()
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
