#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Recorded datagrams of secured clients are sent again, from their own and from another port: while the clients live, after
they have ended, and after the gateway was restarted. No request is carried out twice, and the gateway from before the
restart does not count as a second one of its name.

replayed.py LINEGATED LINEGATE PROFILES
"""

import os
import re
import socket
import struct
import subprocess
import threading

from plant_process import EDS, Failure, end, expect, run_test, simulated, stop, until, write
from secured import Secured
from udp_bus import Bus, pause, unpacked

GROUP, PORT = "239.74.163.18", 43128
PLANT = f"""schema: 1
gateway: {{name: plant}}
dds: {{security: identities/plant}}
lines:
  - name: press
    interface: "udp:{GROUP}:{PORT}"
    access: all
    sdo_timeout: 6s
    nodes: [{{id: 8, name: io, eds: {EDS}/digital-io.eds, heartbeat: 100ms}}]
"""
# What the requests below send on the bus; nothing else sends these frames.
TO_A_DEVICE = "608#2b17100096"
TO_NO_DEVICE = "609#2b17100096"
OUTPUTS = "208#0f"
SDO_WRITE = ("1017:00", "u16", "150")


class Replay:
    """Records the RTPS datagrams of the loopback interface, and sends them again."""

    def __init__(self, domain):
        self.first = 7400 + 250 * int(domain)
        self.datagrams, self.recording = [], True
        self.packets = socket.socket(socket.AF_PACKET, socket.SOCK_DGRAM, socket.htons(0x0800))
        self.packets.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 8 << 20)
        self.packets.bind(("lo", 0x0800))
        self.raw = socket.socket(socket.AF_INET, socket.SOCK_RAW, socket.IPPROTO_RAW)
        self.other = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.raw.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, socket.inet_aton("127.0.0.1"))
        self.other.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, socket.inet_aton("127.0.0.1"))
        threading.Thread(target=self.record, daemon=True).start()

    def record(self):
        while True:
            packet, address = self.packets.recvfrom(70000)
            # The loopback interface shows each packet twice: outgoing and incoming.
            if not self.recording or address[2] == socket.PACKET_OUTGOING or packet[9] != socket.IPPROTO_UDP:
                continue
            begin = (packet[0] & 0x0F) * 4
            source, target = struct.unpack(">HH", packet[begin:begin + 4])
            if packet[begin + 8:begin + 12] == b"RTPS" and self.first <= target < self.first + 250:
                self.datagrams.append((source, packet[16:20], target, packet[begin + 8:]))

    def to_the_gateway(self):
        """Number of datagrams to the first participant of the host, as the gateway is."""
        return sum(target in (self.first + 10, self.first + 11) for _, _, target, _ in self.datagrams)

    def send(self):
        """Sends each twice, in their order: with the source port that it had, and with another one."""
        self.recording = False
        for source, address, target, data in list(self.datagrams):
            header = struct.pack(">BBHHHBBH4s4s", 0x45, 0, 28 + len(data), 0, 0, 1, socket.IPPROTO_UDP, 0,
                                 socket.inet_aton("127.0.0.1"), address)
            udp = struct.pack(">HHHH", source, target, 8 + len(data), 0)
            self.raw.sendto(header + udp + data, (socket.inet_ntoa(address), 0))
            self.other.sendto(data, (socket.inet_ntoa(address), target))
            pause(0.0005)
        pause(0.5)  # for what the gateway would do

    def resume(self):
        self.recording = True


class Frames(Bus):
    """Counts the frames of the bus."""

    def __init__(self):
        self.frames = []
        super().__init__(GROUP, PORT)

    def listen(self):
        while True:
            frame = unpacked(self.socket.recv(2048))
            if frame is not None:
                self.frames.append(f"{frame[0]:03x}#{frame[1].hex()}")

    def count(self, frame):
        return sum(one.startswith(frame) for one in list(self.frames))

    def counts(self):
        return {frame: self.count(frame) for frame in (TO_A_DEVICE, TO_NO_DEVICE, OUTPUTS)}


def received(secured):
    """The number of datagrams that the guard of the gateway received."""
    def counter():
        text = secured.ask("viewer", "gateways").stdout
        found = re.search(r"guard-received (\d+)", text)
        return int(found[1]) if found else None
    return until("the counters of the gateway", counter)


def console(secured, *words):
    return subprocess.Popen([secured.linegate, "--profile", secured.profiles, "--domain", secured.domain, "--wait", "20",
                             "--security", os.path.join(secured.identities, "engineer"), *words],
                            stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)


def sent_once(secured, bus, frame, *words):
    """Runs a console whose request sends that frame, and returns the console while it runs. One that the library did not
    authenticate is started again."""
    def started():
        process = console(secured, *words)
        while process.poll() is None:
            if bus.count(frame) != 0:
                return process
            pause(0.1)
        return process if bus.count(frame) != 0 else None
    process = until(f"{words} has sent its frame", started)
    expect(f"frames of {words}", bus.count(frame), 1)
    return process


def while_clients_live(secured, bus, replay):
    lives = sent_once(secured, bus, TO_NO_DEVICE, "sdo", "write", "press:9", *SDO_WRITE)
    replay.send()
    expect("the client of the command lives", lives.poll(), None)
    expect("frames of a command whose datagrams were sent again", bus.count(TO_NO_DEVICE), 1)
    lives.wait()
    replay.resume()
    secured.until_it_ends("engineer", ["sdo", "write", "press:8", *SDO_WRITE], True)
    until("the other value of the PDO is written",  # 4: it waits for the first value
          lambda: secured.ask("engineer", "write", "press", "io.6200:02", "0").returncode in (0, 4))
    holds = sent_once(secured, bus, OUTPUTS, "write", "press", "io.6200:01", "0x0F", "--hold", "6s")
    replay.send()
    expect("the client of the outputs lives", holds.poll(), None)
    replay.resume()
    text = holds.communicate()[0]
    expect(f"exit status of --hold\n{text}", holds.returncode, 0)


def nothing_is_repeated(secured, bus, replay, when, times=1):
    before, counts = received(secured), bus.counts()
    for _ in range(times):
        replay.send()
    expect(f"frames after datagrams were sent again {when}", bus.counts(), counts)
    arrived = received(secured) - before
    print(f"{when}: {len(replay.datagrams)} datagrams sent {2 * times} times, the gateway received {arrived}")
    if arrived < times * replay.to_the_gateway() // 2:  # a quarter: the kernel drops those that find a queue full
        raise Failure(f"the gateway received only {arrived} datagrams")


def test(folder, linegated, linegate, profiles):
    secured = Secured(folder, linegated, linegate, profiles)
    secured.security("init", secured.identities)
    for name, role in (("plant", "gateway"), ("engineer", "engineer"), ("viewer", "viewer")):
        secured.security("issue", secured.identities, name, "--role", role)
    plant = write(os.path.join(folder, "plant.yaml"), PLANT)
    replay, bus = Replay(secured.domain), Frames()
    process = secured.gateway(plant)
    try:
        with simulated(linegate, f"udp:{GROUP}:{PORT}", {8: "digital-io"}):
            until("the viewer sees the line", lambda: secured.lines("viewer") == ["press"])
            while_clients_live(secured, bus, replay)
            expect("frames of each request", bus.counts(), {TO_A_DEVICE: 1, TO_NO_DEVICE: 1, OUTPUTS: 1})
            nothing_is_repeated(secured, bus, replay, "after the clients ended")
            end(process)
            process = secured.gateway(plant)
            until("the gateway has restarted", lambda: secured.lines("viewer") == ["press"])
            nothing_is_repeated(secured, bus, replay, "after a restart of the gateway", times=5)
            before = bus.count(TO_A_DEVICE)
            until("a new request is carried out",
                  lambda: secured.ask("engineer", "sdo", "write", "press:8", *SDO_WRITE).returncode == 0)
            expect("frames of a new request", bus.count(TO_A_DEVICE), before + 1)
            # The announcements, which are not encrypted, name a gateway that nobody authenticates.
            with open(os.path.join(folder, "log"), encoding="utf-8") as log:
                expect("warnings of a second gateway of this name", log.read().count("of the same name"), 0)
    except BaseException:
        stop(process)
        with open(os.path.join(folder, "log"), encoding="utf-8") as log:
            print(log.read()[-6000:])
        raise
    end(process)


if __name__ == "__main__":
    run_test(test, own_network=True)
