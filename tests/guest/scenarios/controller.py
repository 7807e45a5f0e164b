#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""A controller has errors until it goes bus-off, and recovers: each state is reported in LineState and in Event, in
this order, to a subscriber with Fast DDS and to one with Cyclone DDS; then PDOs flow again, with the same gateway.
Also: the controller of an observer acknowledges no frame, as candump shows at the sender."""

import os
import re

import plant as plant_module
from actors import Witness, check, eventually, play, read, run, send, write_file
from plant import Plant, all_valid
from slcan import OFF, PASSIVE, WARNING, SerialController

BIT_RATE = 1_000_000
NO_ACKNOWLEDGE = "bus error: protocol, no acknowledge"


def plant_on(interface):
    """Returns a plant.yaml with line press on this interface; the devices of press stay on vcan0."""
    text = read(plant_module.PLANT).replace("socketcan:vcan0", f"socketcan:{interface}")
    folder = os.path.dirname(plant_module.PLANT)
    text = re.sub(r"eds: ([^ ,]+)", lambda eds: f"eds: {os.path.normpath(os.path.join(folder, eds[1]))}", text)
    return write_file("controller.yaml", text)


def bus_events(subscriber):
    """Returns its events on the bus of press, without errors that follow another error of the same kind."""
    told = []
    for event in subscriber.events("press"):
        if event["kind"] in ("bus-state", "bus-error", "interface-failed", "interface-ready"):
            is_interface = event["kind"].startswith("interface")
            text = event["kind"] if is_interface else re.sub(r" \(.*", "", event["text"])
            if not told or told[-1] != text:
                told.append(text)
    return told


def is_told(plant, state):
    for subscriber in plant.subscribers:
        eventually(f"press: LineState of {subscriber.name} has {state}", lambda: subscriber.bus("press") == state)


def up_to_bus_off_and_back(plant, controller):
    before = plant.running.process.pid
    said = plant.refused("bus-restart", "press")
    check(f"a controller that is on the bus is not restarted: {said}", "present state" in said)
    controller.disturb("a", WARNING - 8)
    for subscriber in plant.subscribers:
        eventually(
            f"press: {subscriber.name} is told that nobody acknowledges",
            lambda: NO_ACKNOWLEDGE in bus_events(subscriber),
        )
        check("press: and the controller is error-active yet", subscriber.bus("press") == "error-active")
    for highest, state in ((WARNING, "error-warning"), (PASSIVE, "error-passive")):
        controller.disturb("a", highest)
        is_told(plant, state)
    controller.disturb("b", OFF)  # missing acknowledgements alone never lead to bus-off
    is_told(plant, "bus-off")
    for subscriber in plant.subscribers:
        eventually(
            f"press: {subscriber.name} has no valid value of it",
            lambda: not any(entry["valid"] for entry in subscriber.images("press")[-1]["entries"]),
        )
    controller.repair()
    plant.command("bus-restart", "press")
    eventually("can7 is open again", lambda: controller.commands[-1] == "O")
    is_told(plant, "error-active")
    eventually("press: all nodes are operational again", lambda: plant.is_up("press"))
    for subscriber in plant.subscribers:
        eventually(f"press: PDOs flow again to {subscriber.name}", lambda: all_valid(subscriber.image("press")))
    check("the gateway is still the same process", plant.running.runs() and plant.running.process.pid == before)


def was_told_in_order(plant):
    states = ["error-active", "error-warning", "error-passive", "bus-off"]
    check(
        f"press: LineState said one after the other {plant.stranger.buses('press')}",
        in_order(states + ["error-active"], plant.stranger.buses("press")),
    )
    wanted = [
        "interface-ready",
        NO_ACKNOWLEDGE,
        "bus error-warning",
        "bus error-passive",
        "bus bus-off",
        "interface-failed",
        "bus stopped",
        "interface-ready",
    ]
    for subscriber in plant.subscribers:
        told = bus_events(subscriber)
        check(f"press: Event of {subscriber.name} has the states in order: {told}", in_order(wanted, told))


def in_order(wanted, told):
    """Whether `told` contains all elements of `wanted` in this order."""
    rest = iter(told)
    return all(word in rest for word in wanted)


OBSERVER = """\
schema: 1
lines:
  - name: watched
    interface: socketcan:can9?bitrate=500000
    role: observer
    nodes: [{id: 5, name: any, eds: EDS}]
"""


def an_observer_acknowledges_nothing(plant):
    """On a bus with two controllers, where the other one has no further receiver."""
    run("ip", "link", "add", "bus8", "type", "vcan")
    run("ip", "link", "set", "bus8", "up")
    sender, listener = SerialController("can8", "bus8", 500_000), SerialController("can9", "bus8")
    sender.others = [listener]
    run("ip", "link", "set", "can8", "up")
    witness = Witness("can8", "can8,0:0,#FFFFFFFF")
    eds = os.path.join(os.path.dirname(plant_module.PLANT), "../../../bridges/sim/eds/digital-io.eds")
    observer = plant.gateway("observer", OBSERVER.replace("EDS", os.path.normpath(eds)))
    eventually("can9: the driver tells the controller to listen only", lambda: "L" in listener.commands)
    check("can9: and its bit rate", "S6" in listener.commands)
    check("can9: it was never told otherwise", "O" not in listener.commands)
    send("can8", "185#0102")
    eventually("can8: candump shows a missing acknowledgement", lambda: unacknowledged(witness))
    check("the observer is stopped", observer.stop() == 0)
    run("ip", "link", "set", "can9", "down")
    run("ip", "link", "set", "can9", "type", "can", "listen-only", "off")
    run("ip", "link", "set", "can9", "up")
    eventually("can9: takes part in the bus", lambda: listener.commands[-1] == "O")
    before = len(unacknowledged(witness))
    beside = Witness("can9")
    send("can8", "185#0304")
    eventually("can9: receives a frame", lambda: beside.frames(0x185))
    check("can8: candump shows no error this time", len(unacknowledged(witness)) == before)
    run("ip", "link", "set", "can9", "down")
    run("ip", "link", "set", "can9", "type", "can", "listen-only", "on")
    taking_part = OBSERVER.replace("bitrate=500000", "bitrate=500000&listen-only=off")
    listener.commands.clear()
    observer = plant.gateway("taking-part", taking_part.replace("EDS", os.path.normpath(eds)))
    eventually("can9: listen-only=off takes it out of listen-only", lambda: "O" in listener.commands)
    check("can9: it was not told to listen only", "L" not in listener.commands)
    check("the observer that takes part is stopped", observer.stop() == 0)


def unacknowledged(witness):
    """Returns error frames of the kernel (linux/can/error.h) about missing acknowledgements."""
    return [f for f in witness.frames() if f[1] & 0x20000000 and f[1] & 0x20]


def scenario():
    controller = SerialController("can7", "vcan0", BIT_RATE)
    run("ip", "link", "set", "can7", "up")
    plant = Plant(plant_on("can7"))
    eventually("can7 is on the bus", lambda: controller.commands[-1] == "O")
    up_to_bus_off_and_back(plant, controller)
    was_told_in_order(plant)
    an_observer_acknowledges_nothing(plant)
    plant.stop()


play(scenario)
