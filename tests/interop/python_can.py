#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""The interface udp: with python-can's udp_multicast, in both directions, in a separate network namespace.

python_can.py LINEGATE
"""

import os
import subprocess
import sys
import tempfile
import threading

import can
import msgpack

GROUP, PORT = "239.74.163.5", 43113
URI = f"udp:{GROUP}:{PORT}"

# A message of python-can, and the same as a line of a candump log without its time.
FRAMES = [
    (dict(arbitration_id=0x181, data=[1, 2, 0xFF], is_extended_id=False), "181#0102FF"),
    (dict(arbitration_id=0x000, data=[], is_extended_id=False), "000#"),
    (dict(arbitration_id=0x181, data=[5], is_extended_id=True), "00000181#05"),
    (dict(arbitration_id=0x1FFFFFFF, data=range(8), is_extended_id=True), "1FFFFFFF#0001020304050607"),
    (dict(arbitration_id=0x705, dlc=1, is_remote_frame=True, is_extended_id=False), "705#R1"),
    (dict(arbitration_id=0x200, data=range(64), is_fd=True, bitrate_switch=True,
          is_extended_id=False), "200##5" + bytes(range(64)).hex().upper()),
    (dict(arbitration_id=0x201, data=range(12), is_fd=True, error_state_indicator=True,
          is_extended_id=False), "201##6" + bytes(range(12)).hex().upper()),
]


class Program:
    """A running program, and the lines of its standard output and standard error."""

    def __init__(self, *command):
        self.process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)

    def wait_until_ready(self):
        for line in self.process.stderr:
            if "ready" in line:
                threading.Thread(target=self.process.stderr.read, daemon=True).start()
                return self
        raise RuntimeError("the program ended")

    def contents(self, count):
        """Returns the next lines of a log, without time and interface."""
        return [self.process.stdout.readline().split()[-1] for _ in range(count)]

    def end(self):
        self.process.terminate()
        return self.process.communicate(timeout=20)[0]


def fields(message):
    """Returns the fields of a message that a frame has."""
    return {
        "arbitration_id": message.arbitration_id, "is_extended_id": message.is_extended_id,
        "is_remote_frame": message.is_remote_frame, "is_error_frame": message.is_error_frame,
        "dlc": message.dlc, "data": bytes(message.data), "is_fd": message.is_fd,
        "bitrate_switch": message.bitrate_switch, "error_state_indicator": message.error_state_indicator,
    }


def receive(bus, wanted):
    message = bus.recv(timeout=20)
    if message is None:
        raise RuntimeError(f"python-can received nothing, expected {wanted}")
    return message


def malformed_datagrams():
    good = {"arbitration_id": 0x181, "is_extended_id": False, "dlc": 1, "data": b"\x01"}
    yield b""
    yield b"hello"
    yield b"\xdf\xff\xff\xff\xff"
    yield msgpack.packb(good)[:-1]
    yield msgpack.packb([1, 2, 3])
    yield msgpack.packb(dict(good, arbitration_id=0x800))
    yield msgpack.packb(dict(good, arbitration_id="181"))
    yield msgpack.packb(dict(good, data=bytes(9), dlc=9))
    yield msgpack.packb(dict(good, data={"a": [1]}))
    yield msgpack.packb({key: value for key, value in good.items() if key != "arbitration_id"})
    yield bytes(5000)


def stranger_sends(linegate, bus):
    """Messages from python-can are received; malformed datagrams do no harm."""
    recorder = Program(linegate, "record", URI).wait_until_ready()
    for message, _ in FRAMES:
        bus.send(can.Message(check=True, **message))
    wanted = [line for _, line in FRAMES]
    seen = recorder.contents(len(wanted))
    assert seen == wanted, f"received {seen}, sent {wanted}"

    for datagram in malformed_datagrams():
        bus._multicast.send(datagram)
    bus.send(can.Message(is_error_frame=True, arbitration_id=0x20))
    bus.send(can.Message(arbitration_id=0x77, data=[7], is_extended_id=False))
    seen = recorder.contents(2)
    assert seen == ["20000220#0000000000000000", "077#07"], seen
    assert recorder.end() == "", "something else was received"


def stranger_receives(linegate):
    """python-can receives the frames that linegate sends."""
    with tempfile.NamedTemporaryFile("w", suffix=".log") as log:
        log.writelines(f"(1.{i:06}) can0 {line}\n" for i, (_, line) in enumerate(FRAMES))
        log.flush()
        with open_bus() as bus:
            subprocess.run([linegate, "replay", log.name, URI, "--speed", "max"], check=True, timeout=60)
            for message, line in FRAMES:
                wanted = fields(can.Message(check=True, **message))
                seen = fields(receive(bus, line))
                assert seen == wanted, f"{line}: python-can received {seen}, not {wanted}"


def stranger_asks_a_device(linegate):
    """An SDO upload of 1000h from a simulated device."""
    with open_bus() as bus:
        device = Program(linegate, "simulate", URI, "--device", "digital-io:5")
        while receive(bus, "a boot-up").arbitration_id != 0x705:
            pass
        request = [0x40, 0x00, 0x10, 0x00, 0, 0, 0, 0]
        bus.send(can.Message(arbitration_id=0x605, data=request, is_extended_id=False))
        message = receive(bus, "an answer")
        while message.arbitration_id != 0x585:
            message = receive(bus, "an answer")
        assert bytes(message.data)[:6].hex() == "430010009101", bytes(message.data).hex()
        device.end()


def open_bus():
    return can.Bus(interface="udp_multicast", channel=GROUP, port=PORT, hop_limit=0, fd=True)


def main(linegate):
    with open_bus() as bus:
        stranger_sends(linegate, bus)
    stranger_receives(linegate)
    stranger_asks_a_device(linegate)


def in_a_network_of_its_own(arguments):
    """Restarts this program with only a loopback interface, so that no datagram enters or leaves."""
    commands = "ip link set lo up multicast on && ip route add 224.0.0.0/4 dev lo && exec \"$@\""
    as_root = [] if os.getuid() == 0 else ["--map-root-user"]
    os.execvp("unshare", ["unshare", "--net", *as_root, "sh", "-c", commands, "sh", sys.executable, "-B",
                          *arguments, "--inside"])


if __name__ == "__main__":
    if sys.argv[-1] != "--inside":
        in_a_network_of_its_own(sys.argv)
    main(sys.argv[1])
