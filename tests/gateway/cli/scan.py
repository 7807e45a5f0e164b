#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""linegate scan: a gateway without any configured device finds all devices on its line and writes to none of them;
the plant that it writes boots at the next start, with the same image as the configured plant. With --apply, or by
`auto:`, the running line applies the result of the scan, with the same image as the written plant.

scan.py LINEGATED LINEGATE PROFILES [PART]. PART `beside`: devices of another program, on a line that is a multicast
group in a separate network namespace. PART `inside`: devices that the gateway simulates itself. Without PART: both.
"""

import json
import os
import re

import plant_process
from plant_process import EDS, Failure, SOURCES, run_test, simulated, until, write

DEMO = os.path.join(SOURCES, "deploy", "plants", "demo.yaml")
URI = "udp:239.74.163.9:43119"
DEVICES = {5: "drive", 7: "encoder", 8: "digital-io", 10: "analog-io"}
HEAD = "schema: 1\ngateway: {name: scan}\n"
LINE = f"""lines:
  - name: press
    interface: "{URI}"
    bit_rate: 1Mbit
"""


class Plant(plant_process.Plant):
    def layouts(self, plant, line="press", count=len(DEVICES)):
        """Returns the layouts of both directions, once all nodes of that plant are Operational."""
        with self.running(plant):
            return self.layouts_now(plant, line, count)

    def layouts_now(self, what, line="press", count=len(DEVICES)):
        self.await_operational(line, count, what)

        def valid():
            image = self.image(line)
            return image if any(entry["valid"] for entry in image["entries"]) else None

        inputs = until(f"inputs of {what} are valid", valid)
        return [inputs["layout_id"], self.image(line, "--outputs")["layout_id"]]

    def image(self, line, *which):
        return self.stream("image", line, *which)[0]


def run(plant, folder):
    configured = "".join(f"      - {{id: {node}, eds: {EDS}/{profile}.eds}}\n" for node, profile in DEVICES.items())
    wanted = plant.layouts(write(f"{folder}/configured.yaml", HEAD + LINE + "    nodes:\n" + configured))

    with plant.running(write(f"{folder}/bare.yaml", HEAD + LINE + "    sync: 20ms\n")):
        scanned = plant.command("--json", "scan", "press", "--write", f"{folder}/found", "--eds", EDS)
        nodes = json.loads(scanned.stdout)["nodes"]
        if {node["node"] for node in nodes} != set(DEVICES) or not all(node["complete"] for node in nodes):
            raise Failure("the scan found " + scanned.stdout)
        if scanned.stderr.count("scanned, ") != len(DEVICES):
            raise Failure("the nodes were not told while they were read:\n" + scanned.stderr)
        one = plant.command("scan", "press:8").stdout
        if "heartbeat" not in one and "none" not in one:
            raise Failure("one node alone:\n" + one)
        plant.command("scan", "press", "--write", f"{folder}/found", code=1)  # never overwrites files
    with open(f"{folder}/found/plant.yaml", encoding="utf-8") as file:
        if "sync: 20ms\n" not in file.read():
            raise Failure("the SYNC of the line that was scanned is not in the plant that was written")
    found = plant.layouts(f"{folder}/found/plant.yaml")
    if found != wanted:
        raise Failure(f"layouts {found} of what was found, {wanted} of what was configured")
    return wanted


def run_applied(plant, folder):
    """The line applies the result of a scan, without device files; the plant written from it yields the same line."""
    with plant.running(write(f"{folder}/applied.yaml", HEAD + LINE + "    access: all\n")):
        plant.command("sdo", "read", "press:5", "1018", "1", "--cached")  # nothing is cached: the device answers
        plant.command("scan", "press", "--restore-defaults", "--apply", "--write", f"{folder}/applied")
        live = plant.layouts_now("what was applied")
        plant.command("sdo", "read", "press:5", "1018", "1", "--cached")
        nodes = plant.json("scan", "press")["nodes"]
        if any(node.get("heartbeat_ms", 0) == 0 for node in nodes):
            raise Failure(f"a device without a heartbeat: {nodes}")
        plant.command("scan", "press:8", "--apply")  # one node again: the others are unchanged
        again = plant.layouts_now("what one node was read again of")
    written = plant.layouts(f"{folder}/applied/plant.yaml")
    if not live == again == written:
        raise Failure(f"layouts {live} of what was applied, {again} after one node, {written} of what was written")


def run_auto(plant, folder, wanted):
    """A line that is configured by the devices on it, with device files for names and types."""
    for set_up in ("false", "true"):
        auto = f"    auto: {{eds: {EDS}, set_up: {set_up}}}\n"
        found = plant.layouts(write(f"{folder}/auto-{set_up}.yaml", HEAD + LINE + auto))
        if found != wanted:
            raise Failure(f"layouts {found} of what was found at the start, {wanted} of what was configured")


def run_simulated(plant, folder):
    """The written plant includes the devices that the gateway simulates itself."""
    devices = "".join(f"      - {{node: {node}, profile: {profile}}}\n" for node, profile in DEVICES.items())
    line = LINE.replace(URI, "simulated:")
    with plant.running(write(f"{folder}/simulated.yaml", HEAD + line + "    simulate:\n" + devices)):
        plant.command("scan", "press", "--write", f"{folder}/embedded")
    plant.layouts(f"{folder}/embedded/plant.yaml")


def without_configuration(plant):
    """Returns a plant with the simulated lines and devices of that one, without configured nodes, and the number of
    devices of each line."""
    text, counts = HEAD + "lines:\n", {}
    for line in re.split(r"^  - (?=name: )", open(plant, encoding="utf-8").read(), flags=re.MULTILINE)[1:]:
        name = re.match(r"name: (\S+)", line)[1]
        devices = re.findall(r"^      - (\{node: .*\})$", line, re.MULTILINE)
        network = re.search(r"network_id: (\d+)", line)[1]
        text += (f"  - name: {name}\n    interface: 'simulated:'\n    network_id: {network}\n    access: all\n"
                 f"    simulate: [{', '.join(devices)}]\n")
        counts[name] = len(devices)
    return text, counts


def run_demo(plant, folder):
    """The demo plant without configuration: every device is found, and the written plant boots with the same image."""
    text, counts = without_configuration(DEMO)
    live = {}
    with plant.running(write(f"{folder}/demo.yaml", text)):
        for line, count in counts.items():
            plant.command("scan", line, "--apply", "--write", f"{folder}/demo-{line}")
            live[line] = plant.layouts_now(f"line {line} of the demo", line, count)
    for line, count in counts.items():
        written = plant.layouts(f"{folder}/demo-{line}/plant.yaml", line, count)
        if written != live[line]:
            raise Failure(f"layouts {written} of what was written of {line}, {live[line]} of what was applied")


def test(folder, linegated, linegate, profiles, part=None):
    plant = Plant(linegated, linegate, profiles, "199")
    if part in (None, "beside"):
        with simulated(linegate, URI, DEVICES):
            wanted = run(plant, folder)
            run_applied(plant, folder)
            run_auto(plant, folder, wanted)
    if part in (None, "inside"):
        run_demo(plant, folder)
        run_simulated(plant, folder)


if __name__ == "__main__":
    run_test(test, own_network=True)
