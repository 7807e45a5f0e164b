#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""A bus without acknowledgements: writes and commands are not carried out meanwhile, and report what they wait for.
The vcan of this scenario echoes a frame when its driver receives it (`echo=1`), like drivers of controllers, and a
queueing discipline keeps the frames from the driver."""

import os
import subprocess

from actors import Actor, Site, Witness, check, eventually, play

NODE = 5
EDS = os.path.abspath(os.path.join(os.path.dirname(__file__), "../../../bridges/sim/eds/digital-io.eds"))
FIRST, SECOND = f"{NODE}.6200:01", f"{NODE}.6200:02"
NO_ACKNOWLEDGE = "the bus: no acknowledge"
PLANT = """\
schema: 1
gateway: {name: guest}
lines:
  - name: hall
    interface: socketcan:vcan0
    bit_rate: 500kbit
    access: all
    nodes:
      - {id: 5, name: panel, eds: EDS}
"""


def ip(*arguments):
    subprocess.run(["ip", "link", *arguments], check=True)


def make_bus():
    modules = os.environ["modules"]
    for interface in ("vcan0", "vcan1", "vcan2"):
        ip("del", interface)
    subprocess.run(["rmmod", "vcan"], check=True)
    subprocess.run(["insmod", f"{modules}/drivers/net/can/vcan.ko", "echo=1"], check=True)
    subprocess.run(["insmod", f"{modules}/net/sched/sch_netem.ko"], check=True)
    ip("add", "vcan0", "type", "vcan")
    ip("set", "vcan0", "up")


def hold_frames():
    subprocess.run(["tc", "qdisc", "add", "dev", "vcan0", "root", "netem", "delay", "200s"], check=True)


def drop_frames():
    subprocess.run(["tc", "qdisc", "del", "dev", "vcan0", "root"], check=True)


class Hall(Site):
    def __init__(self):
        super().__init__()
        make_bus()
        self.bus = Witness("vcan0")
        self.device = Actor(
            "device", self.programs.linegate, "simulate", "socketcan:vcan0", "--device", f"digital-io:{NODE}"
        )
        self.linegated = self.gateway("hall", PLANT.replace("EDS", EDS))

    def operational(self):
        nodes = self.command("nodes", "hall")
        return any(node["node"] == NODE and node.get("state") == "operational" for node in nodes)

    def output(self):
        entries = self.command("image", "-o", "hall")["entries"] or []
        return next((entry for entry in entries if entry["sub"] == 1), {"valid": None})


def waits_for_bus(hall, *arguments):
    said = hall.held_back(*arguments)
    check(f"{' '.join(arguments)} says that it waits for the bus", NO_ACKNOWLEDGE in said)


def scenario():
    hall = Hall()
    eventually("the device is operational", hall.operational)
    hall.held_back("write", "hall", FIRST, "0x11")
    check("a write was sent", hall.command("write", "hall", SECOND, "0x22")["value"].endswith(", sent"))
    check("an NMT command was sent", hall.command("nmt", "start", f"hall:{NODE}")["value"] == "sent")
    eventually("the output is valid", lambda: hall.output()["valid"])

    hold_frames()
    waits_for_bus(hall, "write", "hall", FIRST, "0x33")
    waits_for_bus(hall, "--json", "write", "hall", FIRST, "0x33")
    waits_for_bus(hall, "nmt", "start", f"hall:{NODE}")
    waits_for_bus(hall, "--json", "nmt", "start", f"hall:{NODE}")
    shown = hall.output()
    check("the output is not valid", shown["valid"] is False)
    eventually("and waits for the bus", lambda: NO_ACKNOWLEDGE in hall.output()["state"])

    drop_frames()
    check("a later frame was sent", hall.command("send", "hall", "123#11")["value"] == "sent")
    eventually("the value that was lost is sent again", lambda: hall.output()["valid"])
    hall.bus.await_frame(0x200 + NODE, b"\x33\x22")
    check("the gateway ends well", hall.linegated.stop() == 0)


play(scenario)
