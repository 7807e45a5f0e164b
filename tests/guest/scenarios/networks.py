#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Three lines are three networks: a foreign SDO client (npm's `canopen`) on the first reads and writes devices on
the others through a gateway, with network indications sent by hand. Witnesses prove that each frame was on the right
lines and on no other. Then the same through two gateways, two processes that share the line in the middle."""

import struct

from actors import Actor, Site, Witness, check, eventually, play
from stranger import FRAME, Stranger

PRESS, HALL, PACK = 1, 2, 3  # networks
STRANGER, OWN, CLIMATE, BELT = 20, 127, 10, 22
REFUSED_NETWORK = 0x06090030

ONE = """\
schema: 1
gateway: {name: one}
lines:
  - {name: press, interface: "socketcan:vcan0", network_id: 1, access: all, reset_nodes: false}
  - {name: hall, interface: "socketcan:vcan1", network_id: 2, access: all, reset_nodes: false, enter: press}
  - name: pack
    interface: socketcan:vcan2
    network_id: 3
    access: all
    reset_nodes: false
    enter: [{from: press, access: all}]
"""
# 101 and 102 are the gateways on the line that they share.
WEST = """\
schema: 1
gateway: {name: west}
routes: [{to: 3, via: "hall:102"}]
lines:
  - {name: press, interface: "socketcan:vcan0", network_id: 1, access: all, reset_nodes: false}
  - name: hall
    interface: socketcan:vcan1
    network_id: 2
    node_id: 101
    access: all
    reset_nodes: false
    enter: [{from: press, access: all}]
"""
EAST = """\
schema: 1
gateway: {name: east}
lines:
  - {name: between, interface: "socketcan:vcan1", network_id: 2, node_id: 102, access: all, reset_nodes: false}
  - name: pack
    interface: socketcan:vcan2
    network_id: 3
    access: all
    reset_nodes: false
    enter: [{from: between, access: all}]
"""


def indication(network, node):
    return struct.pack("<BHBB3x", 0xE0, network, node, 1)


class Networks(Site):
    def __init__(self):
        super().__init__("modules")
        self.bus = {network: Witness(f"vcan{network - 1}") for network in (PRESS, HALL, PACK)}
        self.stranger = Stranger("vcan0", STRANGER, self.programs.modules)
        check("the stranger is ready", self.stranger.next_answer() == {"ready": True})
        for interface, device in (("vcan1", f"analog-io:{CLIMATE}"), ("vcan2", f"digital-io:{BELT}")):
            Actor(f"device-{device}", self.programs.linegate, "simulate", f"socketcan:{interface}", "--device", device)
        for network, node in ((HALL, CLIMATE), (PACK, BELT)):
            eventually(f"node {node} booted", lambda: self.bus[network].frames(0x700 + node))

    def start(self, name, plant, boot_ups):
        """Starts a gateway, and waits for the boot-up messages of its own nodes: (network, node-ID)."""
        so_far = {(network, node): self.bus[network].boot_ups(node) for network, node in boot_ups}
        gateway = self.gateway(name, plant)
        for network, node in boot_ups:
            eventually(
                f"{name} is on network {network}",
                lambda: self.bus[network].boot_ups(node) > so_far[(network, node)],
            )
        return gateway

    def indicate(self, network, node):
        """Sends a network indication by hand, and returns the 8 bytes of the gateway's answer."""
        data = indication(network, node)
        so_far = len(self.since_indications(data))
        self.stranger.bus.send(FRAME.pack(0x600 + OWN, 8, data))
        return eventually(
            f"an answer to the indication of node {node} in network {network}",
            lambda: (self.since_indications(data)[so_far:] or [[]])[0],
        )[0]

    def since_indications(self, data):
        """For each such indication on the bus, returns the frames that the gateway has sent since. (An earlier
        answer may be late here.)"""
        answers = []
        for _, identifier, seen in self.bus[PRESS].frames():
            if (identifier, seen) == (0x600 + OWN, data):
                answers.append([])
            elif identifier == 0x580 + OWN:
                for each in answers:
                    each.append(seen)
        return answers

    def enter(self, network, node):
        check(f"node {node} in network {network} is reached", self.indicate(network, node) == indication(network, node))

    def upload(self, network, node, index, sub):
        self.enter(network, node)
        return self.stranger.upload(OWN, index, sub)

    def counters(self, line):
        return next(one for one in self.command("routes")["lines"] if one["line"] == line)

    def sent_on(self, network, identifier, data):
        return bytes.fromhex(data) in [seen for _, _, seen in self.bus[network].frames(identifier)]


def reads_and_writes(networks):
    direct = networks.command("sdo", "read", f"pack:{BELT}", "1008", "0")["data"]
    vendor = networks.upload(PACK, BELT, 0x1018, 1)
    check(f"the stranger reads 1018h:1 of another network: {vendor}", vendor == struct.pack("<I", 0x4C47))
    eventually("the request is on the other line", lambda: networks.sent_on(PACK, 0x600 + BELT, "4018100100000000"))
    check("and on no third", networks.bus[HALL].frames(0x600 + BELT) == [])
    name = networks.upload(PACK, BELT, 0x1008, 0)
    check(f"a name in segments: {name}", name == bytes.fromhex(direct))
    networks.enter(PACK, BELT)
    check("it writes 1017h there", networks.stranger.download(OWN, 0x1017, 0, struct.pack("<H", 250)) is None)
    check("and reads it back", networks.upload(PACK, BELT, 0x1017, 0) == struct.pack("<H", 250))
    check(
        "without an indication the gateway itself is meant",
        networks.stranger.upload(OWN, 0x1000, 0) == struct.pack("<I", 0x195),
    )


def is_refused_where_it_has_no_business(networks):
    answer = networks.indicate(9, 1)
    check(f"network 9 is not known: {answer.hex()}", answer == struct.pack("<B3xI", 0x80, REFUSED_NETWORK))
    check("reading is allowed on hall", isinstance(networks.upload(HALL, CLIMATE, 0x1018, 1), bytes))
    networks.enter(HALL, CLIMATE)
    said = networks.stranger.download(OWN, 0x1017, 0, struct.pack("<H", 250))
    check(f"writing is not: {said}", said is not None)
    check("and the device heard nothing of it", not networks.sent_on(HALL, 0x600 + CLIMATE, "2b171000fa000000"))

    def told():
        events = networks.command("monitor", "--once")["events"]
        return {event["line"] for event in events if event["kind"] == "routing-refused"}

    eventually("both are events of the lines that refused", lambda: told() == {"press", "hall"})


def everything_is_free_again(networks):
    def all_ended():
        press = networks.counters("press")
        ended = press["finished"] + press["aborted"] + press["timed_out"]
        return press["open"] == 0 and press["opened"] == ended > 0

    def none_taken():
        pack = networks.counters("pack")
        return pack["channels"] == 0 and pack["forwarded"] > 0

    eventually("all that was opened has ended", all_ended)
    eventually("no client SDO is left taken", none_taken)


def through_two_gateways(networks):
    west = networks.start("west", WEST, [(PRESS, OWN), (HALL, 101)])
    east = networks.start("east", EAST, [(HALL, 102), (PACK, OWN)])
    vendor = networks.upload(PACK, BELT, 0x1018, 1)
    check(f"the stranger reads through two processes: {vendor}", vendor == struct.pack("<I", 0x4C47))
    passed_on = struct.pack("<BHBB3x", 0xE0, PACK, BELT, 2)
    networks.bus[HALL].await_frame(0x600 + 102, passed_on)  # with a hop counted
    name = networks.upload(PACK, BELT, 0x1008, 0)
    direct = networks.command("sdo", "read", f"pack:{BELT}", "1008", "0")["data"]
    check(f"and a name in segments: {name}", name == bytes.fromhex(direct))
    answer = networks.command("sdo", "read", "--via", "west/press", f"3:{BELT}", "1018", "1")
    check("the console does, too, in the place of a device on press", bytes.fromhex(answer["data"]) == struct.pack("<I", 0x4C47))
    east.kill()
    said = networks.refused("sdo", "read", "--via", "west/press", f"3:{BELT}", "1018", "1")
    check(f"a gateway that is gone ends with an abort: {said}", "timed out" in said)
    eventually("nothing is left open", lambda: networks.counters("press")["open"] == 0)
    check("the gateway ends well", west.stop() == 0)


def scenario():
    networks = Networks()
    gateway = networks.start("one", ONE, [(PRESS, OWN), (HALL, OWN), (PACK, OWN)])
    reads_and_writes(networks)
    is_refused_where_it_has_no_business(networks)
    everything_is_free_again(networks)
    check("the gateway ends well", gateway.stop() == 0)
    through_two_gateways(networks)


play(scenario)
