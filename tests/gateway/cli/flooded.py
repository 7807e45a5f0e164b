#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Four clients send 5,000 requests/s each, of different kinds, to a line at 125 kbit/s. The recording of the line
shows that all of them together cause no more frames than its share permits; no heartbeat is lost; each request of
another client is answered meanwhile; the log names the clients.

flooded.py LINEGATED LINEGATE PROFILES REQUEST_FLOOD
"""

import json
import os
import re
import subprocess

import plant_process
from plant_process import Failure, PATIENCE, expect, run_test, stop, write

NODE = 21
BIT_RATE = 125_000
SHARE = 0.3  # the default of request_share
RATE = 5000
SECONDS = 10
KINDS = ("nmt", "can", "sdo", "outputs")
CAUSED = (0x000, 0x101, 0x580 + NODE, 0x600 + NODE, 0x200 + NODE)  # identifiers of what the clients request
PLANT = """schema: 1
gateway: {{name: guest}}
lines:
  - name: hall
    interface: "simulated:"
    bit_rate: 125kbit
    access: all
    sync: 20ms
    record: {record}
    nodes: [{{id: {node}, name: panel, eds: {eds}, heartbeat: {{producer: 100ms, consumer: 1s}}}}]
    simulate: [{{node: {node}, profile: digital-io}}]
"""
FRAME = re.compile(r"\(([0-9.]+)\) \S+ ([0-9A-F]+)#([0-9A-F]*)")


def frames(record):
    """Returns [(time, identifier, number of octets)] of a candump log."""
    with open(record, encoding="ascii") as file:
        found = [FRAME.match(line) for line in file]
    return [(float(one[1]), int(one[2], 16), len(one[3]) // 2) for one in found if one]


def flooded(plant, program, domain, profiles):
    """Reads the device until all floods have ended, and returns their results and the number of reads."""
    # At a lower priority: such clients run on other hosts.
    command = ["nice", "-n", "10", program]
    where = ["guest", "hall", str(NODE), str(RATE), str(SECONDS), domain, profiles]
    floods = [subprocess.Popen([*command, kind, *where], stdout=subprocess.PIPE, text=True) for kind in KINDS]
    reads = 0
    while any(flood.poll() is None for flood in floods):
        read = plant.json("sdo", "read", f"hall:{NODE}", "1000:0", "u32")
        expect("the value for another client", read["ok"], True)
        reads += 1
    results = [json.loads(flood.communicate(timeout=PATIENCE)[0]) for flood in floods]
    return results, reads


def check_share(caused):
    """Fails if the frames use more than the share of the line, or so little that nothing was limited."""
    time = caused[-1][0] - caused[0][0]
    used = sum(1.1 * (47 + 8 * octets) for _, _, octets in caused)  # the mean of stuff bits
    # The burst of 50 ms, and half a second in which a busy machine may delay frames.
    permitted = SHARE * BIT_RATE * (time + 0.55)
    print(f"{len(caused)} frames, {used:.0f} bits in {time:.1f} s; {permitted:.0f} bits permitted")
    if not permitted / 4 < used <= permitted:
        raise Failure(f"clients use {used:.0f} bits in {time:.1f} s, not up to {permitted:.0f}")


def test(folder, linegated, linegate, profiles, request_flood):
    domain = plant_process.own_domain()
    plant = plant_process.Plant(linegated, linegate, profiles, domain)
    record = os.path.join(folder, "hall.log")
    eds = os.path.join(plant_process.EDS, "digital-io.eds")
    path = write(os.path.join(folder, "plant.yaml"), PLANT.format(record=record, node=NODE, eds=eds))
    process = subprocess.Popen([plant.program, path, *plant.options], stderr=subprocess.PIPE, text=True)
    try:
        plant.await_operational("hall", 1)
        results, reads = flooded(plant, request_flood, domain, profiles)
        plant.await_operational("hall", 1, "after the flood")
    except BaseException:
        stop(process)
        raise
    process.terminate()
    log = process.communicate(timeout=PATIENCE)[1]
    expect("the exit status of the gateway", process.returncode, 0)
    for result in results:
        print(result)
    print(f"{reads} reads of another client were answered")
    expect("another client was answered", reads > 0, True)
    expect("heartbeats were lost", "heartbeat" in log, False)
    for kind in KINDS:
        expect(f"the log names the flood of {kind}", f"flood-{kind} at " in log, True)
    check_share([frame for frame in frames(record) if frame[1] in CAUSED])


if __name__ == "__main__":
    run_test(test)
