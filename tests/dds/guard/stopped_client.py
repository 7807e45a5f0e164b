#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""stopped_client.py DDS_PEER PROFILES [LINEGATED]
Over TCPv4 one client stops reading while the gateway goes on sending to it. When the connection takes no more data, another
client receives PDOs as before, a new one finds the gateway, the stopped one receives again, and all processes end. With
LINEGATED the gateway has DDS in a process of its own, and does not replace that process. In a network of its own, with small
socket buffers, so that they are soon full."""

import os
import signal
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import tcp_test  # noqa: E402
import transports  # noqa: E402
from plant_process import EDS  # noqa: E402
from tcp_test import DOMAIN, WITHIN  # noqa: E402

PDOS = 200  # 4 s of them
QUEUED = 400  # at most, in the buffers of the connection to the stopped client
BUFFERS = "4096 16384 32768"  # octets: smallest, initial, largest
UNCHANGED = 0.3  # s; shorter than the limit of the guard

PLANT = """schema: 1
gateway: {{name: stopped}}
dds: {{domain: {domain}, process: own, profile: {profile}}}
lines:
  - name: press
    interface: "simulated:"
    sync: 10ms
    pdo_update: {{min_period: 20ms}}
    publish: {{period: 1ms}}
    nodes: [{{id: 6, eds: {eds}/drive.eds, pdos: {{tpdo1: {{type: sync}}}}}}]
    simulate: [{{node: 6, profile: drive}}]
"""


class OwnProcess:
    """A gateway with DDS in a process of its own, and what it logs."""

    def __init__(self, linegated, profile):
        self.folder = tempfile.TemporaryDirectory()
        plant, log = (os.path.join(self.folder.name, name) for name in ("plant.yaml", "log"))
        with open(plant, "w", encoding="utf-8") as out:
            out.write(PLANT.format(domain=DOMAIN, profile=profile, eds=EDS))
        with open(log, "w", encoding="utf-8") as out:
            self.process = subprocess.Popen([linegated, plant], stdout=out, stderr=subprocess.STDOUT)
        self.log = open(log, encoding="utf-8")

    def end(self):
        self.process.terminate()
        return self.process.wait(WITHIN) == 0

    def replacements(self):
        """The lines about DDS processes that have ended."""
        return [line.strip() for line in self.log if "is started again" in line]


def limit_buffers():
    for name in ("tcp_rmem", "tcp_wmem"):
        with open("/proc/sys/net/ipv4/" + name, "w", encoding="ascii") as out:
            out.write(BUFFERS)


def unsent(port):
    """The octets in the send queues of connections from this local port."""
    with open("/proc/net/tcp", encoding="ascii") as table:
        rows = [line.split() for line in table][1:]
    return [int(row[4].split(":")[0], 16) for row in rows if int(row[1].split(":")[1], 16) == port and row[3] == "01"]


def is_stuck(port):
    """Whether a connection has taken nothing for a time."""
    first = unsent(port)
    time.sleep(UNCHANGED)
    return any(octets and octets in first for octets in unsent(port))


def check(peer, paths, linegated=None):
    limit_buffers()
    gateway = OwnProcess(linegated, paths[0]) if linegated else tcp_test.start_gateway(peer, paths)
    if gateway is None:
        return "the gateway does not start"
    stopped, other = [tcp_test.start_client(peer, paths) for _ in range(2)]
    if not all([tcp_test.receives_pdos(one) for one in (stopped, other)]):
        return "a client does not receive"
    stopped.process.send_signal(signal.SIGSTOP)
    if not transports.eventually(lambda: is_stuck(20000 + DOMAIN)):
        return "the connection to the stopped client always takes data"
    received = other.lines["pdo"]
    if not transports.eventually(lambda: other.lines["pdo"] > received + PDOS):
        return "beside a stopped client, another one receives no more PDOs"
    new = tcp_test.start_client(peer, paths, "subscriber")
    if not tcp_test.receives(new):
        return "beside a stopped client, a new one does not receive"
    stopped.process.send_signal(signal.SIGCONT)
    # Also because a participant of Fast DDS 2.9.1 that is deleted while it opens a connection again may wait for ever for a
    # receiving thread that has ended.
    received = stopped.lines["pdo"]
    if not transports.eventually(lambda: stopped.lines["pdo"] > received + QUEUED + PDOS, WITHIN):
        return "the client that was stopped receives no more PDOs"
    if not all([one.end() for one in (stopped, other, new, gateway)]):
        return "a process does not end"
    replacements = gateway.replacements() if linegated else []
    return "; ".join(replacements) or None


if __name__ == "__main__":
    sys.exit(tcp_test.main(check))
