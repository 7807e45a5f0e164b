#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""A line of CANopen FD beside a classical one: boot, objects by USDO, 64 bytes in a PDO, counters.

canopen_fd.py LINEGATED LINEGATE PROFILES. The lines are simulated inside the gateway.
"""

from plant_process import EDS, Plant, expect, run_test, until, write

DEFAULTS = ", ".join(f"'io.6200:{byte:X}': 0" for byte in range(1, 64))
PLANT = f"""schema: 1
gateway: {{name: canopen-fd}}
lines:
  - name: fast
    interface: "simulated:"
    bit_rate: 1Mbit
    canopen_fd: true
    data_bit_rate: 5Mbit
    emcy_fd: true
    access: all
    nodes: [{{id: 5, name: io, eds: {EDS}/fd-io.eds, heartbeat: 200ms}}]
    simulate: [{{node: 5, profile: fd-io}}]
    outputs: {{defaults: {{{DEFAULTS}}}}}
  - name: plain
    interface: "simulated:"
    bit_rate: 1Mbit
    access: all
    nodes: [{{id: 5, eds: {EDS}/digital-io.eds, heartbeat: 200ms}}]
    simulate: [{{node: 5, profile: digital-io}}]
"""


def counters(plant, line):
    return next(one["counters"] for one in plant.json("monitor", "--once")["lines"] if one["line"] == line)


def run(plant, folder):
    with plant.running(write(f"{folder}/plant.yaml", PLANT)):
        plant.await_operational("fast", 1)
        plant.await_operational("plain", 1)
        for line, name in (("fast", '"Linegate FD I/O"'), ("plain", '"Linegate digital I/O"')):
            expect(f"the name of {line}", plant.json("sdo", "read", f"{line}:5", "1008", "0")["value"], name)
        plant.command("sdo", "write", "fast:5", "1015", "0", "7")
        expect("the value", int(plant.json("sdo", "read", "fast:5", "1015", "0")["value"]), 7)
        refused = plant.command("sdo", "read", "fast:5", "3000", "0", "u8", code=1).stderr
        expect("the refusal", refused.strip(), "object does not exist in the object dictionary")
        plant.command("write", "fast", "io.Write output 8-bit.Output byte 64", "99")

        def mirrored():
            entries = plant.json("image", "fast")["entries"]
            return [one["value"] for one in entries if (one["index"], one["sub"]) == (0x6000, 64) and one["valid"]] == [99]

        until("64 bytes there and back", mirrored)
        fast, plain = counters(plant, "fast"), counters(plant, "plain")
        expect("USDO instead of SDO", (fast["usdo_transfers"] > 10, fast["sdo_transfers"], fast["usdo_aborts"] >= 1),
               (True, 0, True))
        expect("FD frames", fast["fd_frames_sent"] > 10 and fast["fd_frames_received"] > 10, True)
        expect("a classical line", (plain["usdo_transfers"], plain["fd_frames_sent"], plain["sdo_transfers"] > 5),
               (0, 0, True))


def test(folder, linegated, linegate, profiles):
    run(Plant(linegated, linegate, profiles, "198"), folder)


if __name__ == "__main__":
    run_test(test, own_network=True)
