#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""lost_connection.py DDS_PEER PROFILES TCP_FAULTS
Over TCPv4 a client loses its connection, and Fast DDS opens it again before the thread that received on the lost one has
ended (tcp_faults.cpp). The client receives PDOs as before, several times in a row, and all processes end. In a network of
its own."""

import os
import signal
import sys
import tempfile

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path[:0] = [HERE, os.path.join(HERE, "..", "..", "gateway", "cli")]
import mutate  # noqa: E402
import transports  # noqa: E402
from plant_process import INSIDE, in_a_network_of_its_own  # noqa: E402

DOMAIN = 7  # the only one in this network
WITHIN = 60  # s, for a condition
TIMES = 3
PDOS = 50  # 1 s of them


def preload(library):
    mutate.ENVIRONMENT["LD_PRELOAD"] = library


def lose_connection(client, times):
    """Returns what goes wrong, or None."""
    client.process.send_signal(signal.SIGUSR1)
    if not transports.eventually(lambda: client.lines["overtaken"] == times, WITHIN):
        return "Fast DDS does not open the lost connection again"
    received = client.lines["pdo"]
    if not transports.eventually(lambda: client.lines["pdo"] > received + PDOS, WITHIN):
        return "after the loss of connection %d, a client receives nothing" % times
    return None


def check(peer, paths, faults):
    gateway = mutate.Peer(peer, "gateway", DOMAIN, paths[0])
    if not gateway.wait_for("ready", WITHIN):
        return "the gateway does not start"
    preload(faults)
    client = mutate.Peer(peer, "pdo_subscriber", DOMAIN, paths[1])
    if not transports.receives(client, WITHIN) or not client.wait_for("pdo", WITHIN):
        return "a client does not receive"
    for times in range(1, TIMES + 1):
        wrong = lose_connection(client, times)
        if wrong:
            return wrong
    if not all([one.end() for one in (client, gateway)]):
        return "a process does not end"
    client.thread.join()  # until it has read all output
    if client.dropped["reader"] < TIMES or set(client.dropped) != {"reader"}:
        return "the guard of the client counts %s" % dict(client.dropped)
    return None


def main():
    if sys.argv[-1] != INSIDE:
        in_a_network_of_its_own()
    with open(sys.argv[2], encoding="utf-8") as source:
        text = source.read()
    with tempfile.TemporaryDirectory() as folder:
        wrong = check(sys.argv[1], transports.write_profiles(folder, text, "TCPv4", DOMAIN), sys.argv[3])
    print("TCPv4: %s" % (wrong or "ok"))
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
