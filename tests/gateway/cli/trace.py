#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""`linegate trace` shows the connections between two lines; `linegate write --hold` holds a value as long as the
command runs.

trace.py LINEGATED LINEGATE PROFILES
"""

import json
import os
import subprocess
import threading

import plant_process
from plant_process import PATIENCE, expect, run_test, stop, until, write

# Clients on press may enter hall and read; clients on hall may not enter press.
PLANT = """schema: 1
gateway: {{name: routing}}
lines:
  - name: press
    interface: "simulated:"
    network_id: 1
    access: all
    nodes: [{{id: 8, name: panel, eds: {eds}, heartbeat: 500ms}}]
    simulate: [{{node: 8, profile: digital-io}}]
    outputs: {{groups: [{{name: lamps, number: 2, entries: [panel.*]}}]}}
  - name: hall
    interface: "simulated:"
    network_id: 2
    access: all
    enter: press
    nodes: [{{id: 8, name: panel, eds: {eds}, heartbeat: 500ms}}]
    simulate: [{{node: 8, profile: digital-io}}]
"""
DEVICE_TYPE = ("1000:00", "u32")


def connections_are_traced(plant):
    process = subprocess.Popen([*plant.console, "--json", "trace"], stdout=subprocess.PIPE, text=True)
    kinds = set()

    def follow():
        for line in process.stdout:
            kinds.add(json.loads(line).get("kind"))

    reader = threading.Thread(target=follow, daemon=True)
    reader.start()

    def seen():
        plant.command("sdo", "read", "--via", "press", "hall:8", *DEVICE_TYPE)
        return {"routing-opened", "routing-ended"} <= kinds

    try:
        until("a connection from its beginning to its end", seen)
    finally:
        code = stop(process)
    reader.join(PATIENCE)
    expect("the exit status of trace", code, 0)


def the_rules_of_the_line_that_is_entered_hold(plant):
    plant.command("sdo", "read", "--via", "press", "hall:8", *DEVICE_TYPE)
    refused = plant.json("sdo", "read", "--via", "hall", "press:8", *DEVICE_TYPE, code=1)
    expect("the reason for refusing hall to enter press", refused["code"], 0x08000021)
    refused = plant.json("sdo", "write", "--via", "press", "hall:8", "1017", "0", "u16", "500", code=1)
    expect("the reason for refusing a write from press to hall", refused["code"], 0x06010002)


def output(plant, name):
    """Returns the value in the image of the outputs, and whether it is valid."""
    entries = plant.json("image", "press", "-o")["entries"]
    return next((entry["value"], entry["valid"]) for entry in entries if entry["name"] == name)


def a_value_is_held_and_then_0(plant):
    outputs = [entry["name"] for entry in plant.json("image", "press", "-o")["entries"]]
    for name in outputs[1:]:
        plant.ask("write", "press", name, "3")  # the outputs in the same PDO
    process = subprocess.Popen([*plant.console, "write", "press", "panel.6200:01", "0x55", "--while"],
                               stderr=subprocess.PIPE, text=True)
    until("the value in the image", lambda: output(plant, outputs[0]) == (0x55, True))
    expect("its message", process.stderr.readline(), "held; the outputs of group 2 become 0 2 s after the end\n")
    expect("the exit status of write --while", stop(process), 0)
    until("0 after its end", lambda: output(plant, outputs[0]) == (0, True))
    plant.command("write", "press", "panel.6200:01", "7", "--hold", "1s")
    until("0 after --hold", lambda: output(plant, outputs[0]) == (0, True))
    refused = plant.command("write", "press", "panel.6200:01", "7", "--hold", "1s", "--group", "9", code=1)
    expect("a group that the line does not have", "the output is in group 2: --group 2" in refused.stderr, True)


def test(folder, linegated, linegate, profiles):
    plant = plant_process.Plant(linegated, linegate, profiles, plant_process.own_domain())
    text = PLANT.format(eds=os.path.join(plant_process.EDS, "digital-io.eds"))
    with plant.running(write(os.path.join(folder, "plant.yaml"), text)):
        plant.await_operational("press", 1)
        plant.await_operational("hall", 1)
        connections_are_traced(plant)
        the_rules_of_the_line_that_is_entered_hold(plant)
        a_value_is_held_and_then_0(plant)


if __name__ == "__main__":
    run_test(test)
