#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""linegate config: a device whose configuration was changed is found and corrected, object by object; a concise DCF
is written to the manager at run time.

configure.py LINEGATED LINEGATE PROFILES. The line is simulated inside the gateway.
"""

import struct
import sys

from plant_process import EDS, Failure, Plant, expect, run_test, write

PLANT = f"""schema: 1
gateway: {{name: configure}}
lines:
  - name: press
    interface: "simulated:"
    bit_rate: 1Mbit
    access: ACCESS
    nodes:
      - {{id: 5, eds: {EDS}/drive.eds, objects: {{6081: 1000, 6083: 2000}}}}
      - {{id: 7, eds: {EDS}/encoder.eds}}
    simulate:
      - {{node: 5, profile: drive}}
      - {{node: 7, profile: encoder}}
"""


def concise(*writes):
    return struct.pack("<I", len(writes)) + b"".join(
        struct.pack("<HBI", index, sub, len(data)) + data for index, sub, data in writes)


class Configured(Plant):
    def verify(self, *what, code=0):
        return self.json("config", *what, code=code)["nodes"]

    def value(self, *where):
        return int(self.json("sdo", "read", *where, "u32")["value"])


def run(plant, folder):
    with plant.running(write(f"{folder}/plant.yaml", PLANT.replace("ACCESS", "all"))):
        plant.await_operational("press", 2)
        expect("a configured plant", [node["ok"] for node in plant.verify("verify", "press")], [True, True])
        plant.command("sdo", "write", "press:5", "6083", "0", "u32", "77")
        found = plant.verify("verify", "press", code=1)
        expect("the difference", found[0]["differences"],
               [{"object": "6083:00", "expected": "D0070000", "found": "4D000000"}])
        told = plant.command("config", "verify", "press:5", code=1).stdout
        if "6083:00" not in told or "000007D0h" not in told or "0000004Dh" not in told:
            raise Failure("in words:\n" + told)
        expect("applied", plant.verify("apply", "press:5"),
               [{"node": 5, "ok": True, "boot": "", "abort": 0, "differences": []}])
        expect("verified again", [node["ok"] for node in plant.verify("verify", "press")], [True, True])

        good, bad, own = (f"{folder}/{name}.cdc" for name in ("good", "bad", "own"))
        for path, data in ((good, concise((0x6081, 0, struct.pack("<I", 3000)))),
                           (bad, concise((0x6081, 0, struct.pack("<I", 0)))),
                           (own, concise((0x1F22, 7, concise()), (0x1F26, 7, struct.pack("<I", 5)),
                                         (0x1000, 0, bytes(4))))):
            with open(path, "wb") as file:
                file.write(data)
        plant.command("config", "import", "press:5", good)
        expect("imported", [node["ok"] for node in plant.verify("apply", "press:5")], [True])
        expect("the value", plant.value("press:5", "6081", "0"), 3000)
        plant.command("config", "import", "press:5", bad)
        refused = plant.verify("apply", "press:5", code=1)[0]
        expect("refused", (refused["boot"], refused["differences"]),
               ("J", [{"object": "6081:00", "expected": "00000000", "abort": 0x06090032}]))
        told = plant.command("config", "import", "press", own, code=1).stderr
        if "1000:00" not in told or "06010002" not in told:
            raise Failure("an entry the manager itself refuses: " + told)
        expect("the value before", plant.value("press:own", "1F26", "7"), 5)
        plant.command("config", "import", "press:5", sys.argv[0], code=2)
        plant.command("config", "verify", "press:0", code=2)
        told = plant.command("config", "verify", "press:99", code=1).stderr
        if "node 99 is none of press; its nodes: 5 (" not in told:
            raise Failure("a node that is not configured:\n" + told)
    with plant.running(write(f"{folder}/reading.yaml", PLANT.replace("ACCESS", "read"))):
        plant.await_operational("press", 2)
        plant.command("config", "verify", "press")
        plant.command("config", "apply", "press", code=1)


def test(folder, linegated, linegate, profiles):
    run(Configured(linegated, linegate, profiles, "199"), folder)


if __name__ == "__main__":
    run_test(test, own_network=True)
