#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Failures are reported, and so is recovery: killed devices in NodeState and Event within their heartbeat time, and
an interface that goes down; the other lines continue meanwhile. All for a subscriber with Fast DDS and one with
Cyclone DDS."""

import subprocess

from actors import check, eventually, play
from plant import INTERFACES, NODES, Plant, all_valid, utc_seconds
from subscribers import same_events

CONSUMER_TIME = {"press": 5.0, "hall": 5.0}  # 2.5 x the heartbeat time in plant.yaml
SLACK = 1.0  # the guest has one slow CPU


def devices_die(plant, line):
    """Kills the devices, like a power cut. Returns the time of the last heartbeat of each."""
    plant.devices[line].kill()
    plant.bus[line].catch_up(INTERFACES[line])
    return {node: plant.bus[line].frames(0x700 + node)[-1][0] for node in NODES[line]}


def loss_is_told(subscriber, line, last_heard):
    for node, heard in last_heard.items():
        lost = eventually(
            f"{line}: {subscriber.name} receives an event that node {node} was lost",
            lambda: subscriber.events(line, "heartbeat-lost", node),
        )
        after = utc_seconds(lost[-1]["time"]) - heard
        check(
            f"{line}: node {node} was missed {after:.3f} s after its last heartbeat",
            CONSUMER_TIME[line] - 0.01 <= after <= CONSUMER_TIME[line] + SLACK,
        )
    eventually(
        f"{line}: its nodes are missing in NodeState of {subscriber.name}, and each loss was counted once",
        lambda: all(
            node["presence"] == "missing" and node["heartbeats_lost"] == 1
            for node in subscriber.nodes(line).values()
        ),
    )
    eventually(
        f"{line}: no value of a missing node is valid for {subscriber.name}",
        lambda: none_valid(subscriber.image(line)),
    )


def every_loss_is_true(plant):
    """No loss is reported while the bus has the heartbeats of the node, however slow the machine is."""
    for line, consumer_time in CONSUMER_TIME.items():
        lost = plant.subscriber.events(line, "heartbeat-lost")
        for event in lost:
            at = utc_seconds(event["time"])
            before = [time for time, _, _ in plant.bus[line].frames(0x700 + event["node"]) if time <= at]
            check(f"{line}: no heartbeat in the {at - before[-1]:.3f} s before a loss", at - before[-1] >= consumer_time - 0.01)
        check(f"{line}: each of {len(lost)} losses is true", True)


def none_valid(image):
    return not any(entry["valid"] for entry in image["entries"])


def others_run_on(plant, line):
    for subscriber in plant.subscribers:
        first = subscriber.image(line)["sequence"]
        check(f"{line}: runs on, with new images", subscriber.image(line)["sequence"] > first)
        check(f"{line}: no node was lost", subscriber.events(line, "heartbeat-lost") == [])


def devices_return(plant, line):
    plant.devices[line] = plant.simulate(line)
    eventually(f"{line}: all nodes are operational again", lambda: plant.is_up(line))
    for subscriber in plant.subscribers:
        for node in NODES[line]:
            eventually(
                f"{line}: {subscriber.name} receives an event that node {node} was booted again",
                lambda: len(subscriber.events(line, "boot-result", node)) >= 2,
            )
        eventually(
            f"{line}: its values are valid again for {subscriber.name}",
            lambda: all_valid(subscriber.image(line)),
        )


def interface_goes_and_comes(plant):
    def ready():
        return len(plant.subscriber.events("pack", "interface-ready"))

    so_far = ready()
    subprocess.run(["ip", "link", "set", "vcan2", "down"], check=True)
    eventually(
        "pack: an event reports that the interface failed",
        lambda: plant.subscriber.events("pack", "interface-failed")
        + plant.subscriber.events("pack", "bus-state"),
    )
    others_run_on(plant, "hall")
    subprocess.run(["ip", "link", "set", "vcan2", "up"], check=True)
    eventually("pack: an event reports that it is usable again", lambda: ready() > so_far)
    eventually("pack: all nodes are operational again", lambda: plant.is_up("pack"))


def scenario():
    plant = Plant()
    last_heard = devices_die(plant, "press")
    for subscriber in plant.subscribers:
        loss_is_told(subscriber, "press", last_heard)
    others_run_on(plant, "pack")
    devices_return(plant, "press")
    interface_goes_and_comes(plant)
    check("the gateway is still the same process", plant.running.runs())
    every_loss_is_true(plant)
    plant.stop()
    for line in NODES:
        same_events(line, *plant.subscribers)


play(scenario)
