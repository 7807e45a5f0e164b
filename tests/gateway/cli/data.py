#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Data of devices by object and frames of no CANopen service, with the real programs over DDS: objects in a PDO are
written by PDO and others by SDO, PDOs are triggered by command, reads are answered from the image, and frames of
other protocols are sent and received.

data.py LINEGATED LINEGATE PROFILES. The line is a multicast group in a separate network namespace; a second gateway
observes it.
"""

import concurrent.futures
import json
import subprocess
import time

import plant_process
from plant_process import EDS, Failure, PATIENCE, end, run_test, simulated, until, write

URI = "udp:239.74.163.9:43121"
DEVICES = {5: "drive", 8: "digital-io"}
PDO = "3"  # number of the PDO with the outputs of node 8, after the two of the drive
PLANT = """schema: 1
gateway: {{name: {gateway}}}
lines:
  - name: {line}
    interface: "{uri}"
    bit_rate: 1Mbit
    role: {role}
    access: {access}{objects}
    nodes:
"""
OBJECTS = """
    own_objects:
      2100:1: {name: Recipe, type: u16, access: rww, default: 5, high: 100, map: true, image: true}
      6100: {name: Result, type: u32, access: ro, map: true, image: true}
    own_pdos:
      tpdo40: {cob_id: 0x3AA, map: [6100]}"""


class Plant(plant_process.Plant):
    def __init__(self, linegated, linegate, profiles, folder):
        super().__init__(linegated, linegate, profiles, "198")
        self.folder = folder

    def said(self, *words, code=0):
        """Returns the answer, or the error message."""
        told = self.command(*words, code=code)
        return (told.stderr if code == 1 else told.stdout).strip()

    def expect(self, wanted, *words, code=0):
        told = self.said(*words, code=code)
        if told != wanted:
            raise Failure(f"{words} said '{told}', not '{wanted}'")

    def starts(self, line, role, access):
        """Starts a gateway with the line in that role."""
        nodes = "".join(f"      - {{id: {node}, eds: {EDS}/{profile}.eds}}\n" for node, profile in DEVICES.items())
        text = PLANT.format(gateway="of-" + line, line=line, uri=URI, role=role, access=access,
                            objects=OBJECTS if role == "manager" else "")
        return self.gateway(write(f"{self.folder}/{line}.yaml", text + nodes))

    def operational(self):
        lines = self.lines()
        return len(lines) == 2 and all(line.get("nodes_operational") == len(DEVICES) for line in lines)

    def transfers(self):
        """Returns the number of SDO transfers of the line, once it no longer increases."""
        def count():
            return next((line["counters"]["sdo_transfers"] for line in self.lines() if line["line"] == "press"), -1)

        last, now = -2, count()
        while now != last or now < 0:
            last = now
            time.sleep(2)
            now = count()
        return now

    def reads(self, value, *words):
        until(f"{words} read {value}", lambda: self.said("sdo", "read", *words) == value)


def check_objects(plant):
    """Two outputs of node 8 share a PDO; 6083h of the drive is in no PDO."""
    first, second = ("press:8", "6200", "1", "u8"), ("press:8", "6200", "2", "u8")
    waits = ", which waits for: "
    told = plant.said("sdo", "write", *first, "0x55", "--by-pdo", code=4)
    names = told.partition(f"by PDO {PDO}" + waits + "values that were never written: ")[2]
    if "." not in names or "entry " in names:  # as NODE.OBJECT
        raise Failure(f"the PDO that lacks values said '{told}'")
    plant.expect(f"by PDO {PDO}, sent", "sdo", "write", *second, "0x66", "--by-pdo")
    plant.reads("85", *first)
    plant.reads("102", *second)
    plant.expect("by SDO", "sdo", "write", "press:5", "6083", "0", "u32", "1234", "--by-pdo")
    plant.reads("1234", "press:5", "6083", "0", "u32")
    plant.expect(f"by PDO {PDO}" + waits + "trigger", "sdo", "write", *first, "3", "--by-pdo", "--keep")
    plant.expect("85", "sdo", "read", *first)
    plant.expect(f"PDO {PDO}, sent", "trigger", "press:8", "1")
    plant.reads("3", *first)
    plant.expect(f"PDO {PDO}, sent", "trigger", "press", PDO)
    offset = next(entry["bit_offset"] // 8 for entry in plant.json("image", "press", "-o")["entries"]
                  if entry["node"] == 8)
    plant.expect(f"PDO {PDO}, sent", "trigger", "press", str(offset), "--offset")
    plant.expect("no such output entry: press does not send to RPDO 9 of node 8; to its RPDOs: 1",
                 "trigger", "press:8", "9", code=1)
    told = plant.json("sdo", "write", *second, "9", "--by-pdo")
    if told["data"] != "01030000" or told["value"] != f"by PDO {PDO}, sent":
        raise Failure(f"as JSON: {told}")
    before = plant.transfers()
    with concurrent.futures.ThreadPoolExecutor(5) as clients:
        list(clients.map(lambda _: plant.command("sdo", "read", "press:8", "6000", "1", "u8", "--from-image"), range(20)))
    if plant.transfers() != before:
        raise Failure("a read from the image was an SDO")


def check_pdo_numbers(plant):
    """The PDOs that an image contains, and when they were sent: the queue of RPDO numbers in the IXXAT manual."""
    def told():
        plant.command("trigger", "press", PDO)
        pdos = plant.json("image", "press", "-o").get("pdos", [])
        return any(pdo["local_pdo"] == int(PDO) and pdo["node"] == 8 and pdo["remote_pdo"] == 1 and pdo["count"] >= 1
                   and "T" in pdo["time"] for pdo in pdos)
    until("the image tells its PDO", told)


def check_frames(plant):
    refused = "a service of the line uses this CAN identifier"
    listener = subprocess.Popen([*plant.console, "--json", "listen", "watch", "350/7F0", "-n", "2"],
                                stdout=subprocess.PIPE, text=True)
    try:
        plant.expect(refused, "send", "press", "608#00", code=1)
        plant.expect("not possible in the line's role", "send", "watch", "351#00", code=1)
        end = time.monotonic() + PATIENCE
        while listener.poll() is None and time.monotonic() < end:
            plant.command("send", "press", "361#FF")  # outside the range listened to
            plant.command("send", "press", "351#1122")
        heard = [json.loads(line) for line in listener.communicate(timeout=PATIENCE)[0].splitlines()]
    finally:
        listener.kill()
    if len(heard) != 2 or any((frame["id"], frame["data"], frame["line"]) != (0x351, "1122", "watch") for frame in heard):
        raise Failure(f"heard: {heard}")


def check_dictionary(plant):
    """Application objects: those of the configuration, in image and PDO, and those created at run time."""
    plant.expect("5", "od", "press", "read", "2100", "1")
    plant.command("od", "press", "write", "2100", "1", "42")
    told = plant.said("od", "press", "write", "2100", "1", "101", code=1)
    if "too high" not in told:
        raise Failure("above its limit: " + told)

    def recipe():
        entries = plant.json("image", "press")["entries"]
        return [entry["value"] for entry in entries if entry["name"] == "own.Recipe" and entry["valid"]] == [42]
    until("the recipe is in the image", recipe)
    listener = subprocess.Popen([*plant.console, "--json", "listen", "watch", "3AA", "-n", "1"],
                                stdout=subprocess.PIPE, text=True)
    value = 0x01020300
    end = time.monotonic() + PATIENCE
    while listener.poll() is None and time.monotonic() < end:
        value += 1
        plant.command("write", "press", "own.Result", str(value))
    heard = json.loads(listener.communicate(timeout=PATIENCE)[0])
    if not heard["data"].endswith("030201"):
        raise Failure(f"the PDO of the result: {heard}")
    plant.expect(str(value), "od", "press", "read", "6100", "0")
    plant.command("od", "press", "create", "2200", "1", "i16", "Offset", "--default", "-7")
    plant.expect("-7", "od", "press", "read", "2200", "1")
    names = [one["name"] for one in plant.json("od", "press", "list")]
    if not {"Recipe", "Result", "Offset", "Device type"} <= set(names):
        raise Failure(f"the dictionary has {names}")
    if "2200:01" not in plant.said("od", "press", "list", "2200"):
        raise Failure("the object that was created is not listed")
    plant.command("od", "press", "remove", "2200")
    plant.command("od", "press", "read", "2200", "1", code=1)


def check_types(plant):
    """Types of objects come from the device files; press:all addresses each node."""
    plant.command("sdo", "write", "press:5", "6083:00", "77")
    plant.expect("77", "sdo", "read", "press:5", "6083")
    refused = plant.command("sdo", "write", "press:5", "1017:00", "70000", code=2).stderr
    if "which is UNSIGNED16" not in refused:
        raise Failure(f"a value beyond its type: {refused}")
    identity = plant.said("sdo", "read", "press:5", "1018").splitlines()
    if len(identity) != 5 or not identity[1].startswith("1018:01  "):
        raise Failure(f"an object with sub-indices: {identity}")
    each = plant.json("sdo", "read", "press:all", "1018:01")
    if [one["node"] for one in each] != sorted(one["node"] for one in each) or len(each) != len(DEVICES):
        raise Failure(f"of each node: {each}")
    if not all(one["ok"] and one["value"] == "19527" for one in each):
        raise Failure(f"the vendor of each node: {each}")


def check_access(plant):
    not_permitted = "not permitted by the access of the line (`access:` in plant.yaml)"
    plant.expect(not_permitted, "send", "press", "351#00", code=1)
    plant.expect(not_permitted, "sdo", "write", "press:8", "6200", "1", "u8", "1", "--by-pdo", code=1)
    plant.expect(not_permitted, "trigger", "press", "1", code=1)
    plant.expect(not_permitted, "od", "press", "create", "2200", "1", "i16", "Offset", code=1)
    plant.expect("5", "od", "press", "read", "2100", "1")


def run(plant):
    # The observer starts first, because it must receive the NMT start commands: the nodes have no heartbeat.
    watch, press = plant.starts("watch", "observer", "all"), None
    try:
        until("the observer runs", lambda: [line["line"] for line in plant.lines()] == ["watch"])
        press = plant.starts("press", "manager", "all")
        until("all nodes operational", plant.operational)
        check_objects(plant)
        check_types(plant)
        check_pdo_numbers(plant)
        check_frames(plant)
        check_dictionary(plant)
        end(press)
        press = plant.starts("press", "manager", "read")
        until("all nodes operational again", plant.operational)
        check_access(plant)
    finally:
        for process in (press, watch):
            if process is not None and process.poll() is None:
                end(process)


def test(folder, linegated, linegate, profiles):
    with simulated(linegate, URI, DEVICES):
        run(Plant(linegated, linegate, profiles, folder))


if __name__ == "__main__":
    run_test(test, own_network=True)
