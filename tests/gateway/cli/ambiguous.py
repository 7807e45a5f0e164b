#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Four gateways in one domain, each with a line press: a command is sent to a line only if its name is unambiguous,
however late a gateway is discovered, and lists contain the lines of all gateways.

ambiguous.py LINEGATED LINEGATE PROFILES
"""

import os

import plant_process
from plant_process import Failure, expect, run_test, stop, until, write

GATEWAYS = ("a", "b", "c", "d")
REPETITIONS = 4
PLANT = """schema: 1
gateway: {{name: {gateway}}}
lines:
  - name: press
    interface: "simulated:"
    network_id: 1
    access: all
    heartbeat: 1s
    nodes: [{{id: 8, name: panel, eds: {eds}, heartbeat: 500ms}}]
    simulate: [{{node: 8, profile: digital-io}}]
  - name: only-{gateway}
    interface: "simulated:"
    network_id: {network}
    heartbeat: 1s
    nodes: [{{id: 8, name: panel, eds: {eds}, heartbeat: 500ms}}]
    simulate: [{{node: 8, profile: digital-io}}]
"""
READ = ("1000", "0", "u32")


def start(plant, folder, gateway):
    """Starts a gateway with its two lines."""
    text = PLANT.format(gateway=gateway, network=10 + GATEWAYS.index(gateway),
                        eds=os.path.join(plant_process.EDS, "digital-io.eds"))
    return plant.gateway(write(os.path.join(folder, gateway + ".yaml"), text))


def each_has_discovered_the_others(plant, gateways):
    """Whether each line reports all other gateways."""
    lines = plant.ask("--json", "lines")
    if lines.returncode not in (0, 3):
        return False
    wanted = {(gateway, line, ",".join(other for other in gateways if other != gateway))
              for gateway in gateways for line in ("press", "only-" + gateway)}
    return plant_process.json.loads(lines.stdout) and wanted == {
        (one["gateway"], one["line"], one["properties"].get("other-gateways"))
        for one in plant_process.json.loads(lines.stdout)["lines"] if not one["gone"]}


def names_are_refused_or_right(plant, gateways):
    """One round: an ambiguous name is rejected with all candidates; an unambiguous one is answered."""
    refused = plant.command("sdo", "read", "press:8", *READ, code=1)
    expect("the candidates", refused.stderr.strip(),
           "the name matches more than one line: " + " or ".join(f"{gateway}/press" for gateway in gateways))
    refused = plant.command("write", "1", "panel.Write output 8-bit.Outputs 1 to 8", "1", code=1)
    expect("a network-ID that several lines have", "matches more than one line" in refused.stderr, True)
    plant.command("sdo", "read", f"only-{gateways[-1]}:8", *READ)
    plant.command("sdo", "read", f"{gateways[-1]}/press:8", *READ)


def lists_have_all(plant, gateways):
    """One round: the lists have each line of each gateway."""
    wanted = sorted((gateway, line) for gateway in gateways for line in ("press", "only-" + gateway))
    lines = plant.json("lines")["lines"]
    expect("lines", sorted((one["gateway"], one["line"]) for one in lines), wanted)
    nodes = plant.json("nodes")
    expect("nodes", sorted((one["gateway"], one["line"]) for one in nodes), wanted)
    images = plant.stream("image")
    expect("images", sorted((one["gateway"], one["line"]) for one in images), wanted)
    once = plant.json("monitor", "--once")["lines"]
    expect("monitor --once", sorted((one["gateway"], one["line"]) for one in once), wanted)
    versions = plant.text("versions").count("DDS contract")
    expect("versions", versions, len(gateways))


def test(folder, linegated, linegate, profiles):
    plant = plant_process.Plant(linegated, linegate, profiles, plant_process.own_domain())
    processes = {gateway: start(plant, folder, gateway) for gateway in GATEWAYS}
    try:
        until("four gateways that discovered each other", lambda: each_has_discovered_the_others(plant, GATEWAYS))
        for _ in range(REPETITIONS):
            names_are_refused_or_right(plant, GATEWAYS)
            lists_have_all(plant, GATEWAYS)
        for gateway in GATEWAYS[2:]:
            stop(processes.pop(gateway))
        until("two gateways that are left", lambda: each_has_discovered_the_others(plant, GATEWAYS[:2]))
        for _ in range(REPETITIONS):
            names_are_refused_or_right(plant, GATEWAYS[:2])
            lists_have_all(plant, GATEWAYS[:2])
        stop(processes.pop("b"))
        until("one gateway that is left", lambda: each_has_discovered_the_others(plant, GATEWAYS[:1]))
        plant.command("sdo", "read", "press:8", *READ)
    except Failure:
        print(plant.ask("--json", "lines"))
        raise
    finally:
        for process in processes.values():
            process.kill()
            process.wait()


if __name__ == "__main__":
    run_test(test)
