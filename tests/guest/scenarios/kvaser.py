#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Three controllers on one bus, each with a driver of the kernel (kvaser_pci, see ../boot-pci): the gateway
configures the first as its URI specifies, simulated devices use the second, and an observer uses the third, which
sends nothing, not even frames that another program on this machine writes."""

import json
import os
import subprocess

from actors import Actor, Site, Witness, check, eventually, play, run, write_file
from subscribers import FastSubscriber

EDS = os.path.abspath(os.path.join(os.path.dirname(__file__), "../../../bridges/sim/eds/digital-io.eds"))
NODE = 12
PLANT = """\
schema: 1
gateway: {{name: {name}}}
lines:
  - name: {name}
    interface: "socketcan:{interface}"
    bit_rate: {bit_rate}
    role: {role}
    heartbeat: 1s
    sdo_timeout: 5s
    access: all
    publish: {{period: 500ms}}
    nodes: [{{id: 12, name: doors, eds: {eds}, heartbeat: 2s}}]
"""


def plant(name, interface, role="manager", bit_rate="250kbit"):
    return PLANT.format(name=name, interface=interface, role=role, bit_rate=bit_rate, eds=EDS)


def controller(interface):
    """Returns the kernel's data on this interface."""
    told = json.loads(run("ip", "-details", "-json", "link", "show", interface)[1])
    return told[0]["linkinfo"]["info_data"]


def operational(subscriber, line):
    return {node: state["state"] for node, state in subscriber.nodes(line).items()} == {NODE: "operational"}


def valid(subscriber, line):
    images = subscriber.images(line)
    return images and all(entry["valid"] for entry in images[-1]["entries"])


def scenario():
    site = Site()
    subprocess.run("ip link set can1 type can bitrate 250000".split(), check=True)
    subprocess.run("ip link set can1 up".split(), check=True)
    devices = write_file("devices.yaml", plant("devices", "can1"))
    Actor("devices", site.programs.linegate, "simulate", "--plant", devices, "--line", "devices")
    bus = Witness("can1")
    uri = "can0?bitrate=250000&sample-point=0.75&restart-ms=200"
    gateway = site.gateway("hall", plant("hall", uri, bit_rate="500kbit"))
    subscriber = FastSubscriber(site.programs.linegate)
    eventually("hall: its node is operational", lambda: operational(subscriber, "hall"))
    eventually("hall: its values are valid", lambda: valid(subscriber, "hall"))
    set_up = controller("can0")
    check(f"can0: has its bit rate: {set_up}", set_up["bittiming"]["bitrate"] == 250_000)
    check("can0: and its sample point", set_up["bittiming"]["sample_point"] == "0.750")
    check("can0: and restarts by itself", set_up["restart_ms"] == 200)
    check("can0: acknowledges", "LISTEN-ONLY" not in set_up.get("ctrlmode", []))
    line = subscriber.line("hall")
    check(f"hall: LineState has the bit rate of the controller: {line}", line["bit_rate"] == 250_000)
    check("hall: and its restart", line["properties"]["restart-ms"] == "200")
    check("hall: and its mode", line["properties"]["listen-only"] == "off")
    check(
        "hall: the log says that the configuration has another bit rate",
        "can0?bitrate=250000&sample-point=0.75&restart-ms=200 runs at 250000 bit/s, but the configuration of the line "
        "has 500000 bit/s" in gateway.text(),
    )

    subprocess.run("ip link set can2 type can bitrate 250000".split(), check=True)
    subprocess.run("ip link set can2 up".split(), check=True)
    loud = site.gateway("loud", plant("loud", "can2", "observer"))
    eventually(
        "loud: the log says that its controller acknowledges",
        lambda: "can2 acknowledges frames of other nodes" in loud.text(),
    )
    check("that observer ends well", loud.stop() == 0)
    subprocess.run("ip link set can2 down".split(), check=True)

    observer = site.gateway("quiet", plant("quiet", "can2?bitrate=250000", "observer"))
    eventually("quiet: observes valid values", lambda: valid(subscriber, "quiet"))
    check("can2: listens only", "LISTEN-ONLY" in controller("can2").get("ctrlmode", []))
    eventually(
        "quiet: so says LineState", lambda: subscriber.line("quiet").get("properties", {}).get("listen-only") == "on"
    )
    check("quiet: and nobody complains", "acknowledges" not in observer.text())
    run("cansend", "can2", "7FF#01")
    told = site.command("nodes", "hall")
    check(f"hall: goes on {told}", gateway.runs() and observer.runs())
    check("can1: nothing came from can2", bus.frames(0x7FF) == [])
    check("the observer ends well", observer.stop() == 0)
    check("the gateway ends well", gateway.stop() == 0)


play(scenario)
