#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""lost_connection.py DDS_PEER PROFILES TCP_FAULTS
Over TCPv4 a client loses its connection, and Fast DDS opens it again before the thread that received on the lost one has
ended (tcp_faults.cpp). The client receives PDOs as before, several times in a row, and all processes end. In a network of
its own."""

import os
import signal
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import mutate  # noqa: E402
import tcp_test  # noqa: E402
import transports  # noqa: E402
from tcp_test import WITHIN  # noqa: E402

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
    gateway = tcp_test.start_gateway(peer, paths)
    if gateway is None:
        return "the gateway does not start"
    preload(faults)
    client = tcp_test.start_client(peer, paths)
    if not tcp_test.receives_pdos(client):
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


if __name__ == "__main__":
    sys.exit(tcp_test.main(check))
