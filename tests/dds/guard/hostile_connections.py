#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""hostile_connections.py DDS_PEER PROFILES
Hosts connect to a gateway over TCPv4 and send what Fast DDS 2.9.1 crashes at, skips gigabytes for, or loops for ever for.
Each loses its own connection. A client receives PDOs as before, a new one finds the gateway, and all processes end. In a
network of its own."""

import collections
import os
import socket
import struct
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import tcp_test  # noqa: E402
import transports  # noqa: E402
from tcp_test import DOMAIN, WITHIN  # noqa: E402

PDOS = 50  # 1 s of them


def header(length, port=0):
    return struct.pack("=4sIIH", b"RTCP", length, 0, port)


def control(kind, rest):
    return header(30 + len(rest)) + struct.pack("=BBH12x", kind, 0, 16 + len(rest)) + rest


def content(octets, claimed=None):
    return struct.pack("=HI", 0, len(octets) if claimed is None else claimed) + octets


# The second member: whether the host closes the connection at once.
HOSTILE = {
    "another protocol": (b"GET / HTTP/1.1\r\n\r\n", False),
    "a message of 1.3 GB": (header(0x50435452, 7411), False),
    "a message of 4 GiB that ends at once": (header(0xFFFFFFFF, 7411), True),
    "a message shorter than its header": (header(3, 7411), True),
    "a control message of 5 octets": (header(19) + struct.pack("=BBHB", 0xD1, 0, 5, 0), False),
    "a control message of no octets": (header(14), False),
    "a content of 4 GiB": (control(0xD1, content(bytes(32), 0xFFFFFFF0)), False),
    "a sequence of 2^32 - 1 ports": (control(0xD3, content(b"\0\1\0\0" + b"\xff" * 4)), False),
    "an unknown control message": (control(0x77, b""), False),
}


def attack(octets, close):
    """Returns whether the gateway ends the connection; unknown, so True, if this side does."""
    with socket.create_connection(("127.0.0.1", 20000 + DOMAIN), timeout=WITHIN) as host:
        host.sendall(octets)
        try:
            return close or host.recv(1) == b""
        except ConnectionResetError:  # closed with octets that were not read
            return True
        except socket.timeout:
            return False


def check(peer, paths):
    gateway = tcp_test.start_gateway(peer, paths)
    if gateway is None:
        return "the gateway does not start"
    client = tcp_test.start_client(peer, paths)
    if not tcp_test.receives_pdos(client):
        return "a client does not receive"
    for number, (name, (octets, close)) in enumerate(HOSTILE.items(), start=1):
        if not attack(octets, close):
            return "the gateway keeps a connection with " + name
        if not transports.eventually(lambda: gateway.dropped["stream"] == number, WITHIN):
            return "the guard does not count a connection with " + name
    received = client.lines["pdo"]
    if not transports.eventually(lambda: client.lines["pdo"] > received + PDOS, WITHIN):
        return "a client receives no more PDOs"
    new = tcp_test.start_client(peer, paths, "subscriber")
    if not tcp_test.receives(new):
        return "a new client does not receive"
    if not all([one.end() for one in (client, new, gateway)]):
        return "a process does not end"
    for one in (client, new, gateway):
        one.thread.join()  # until it has read all output
    dropped = gateway.dropped + client.dropped + new.dropped
    return None if dropped == collections.Counter(stream=len(HOSTILE)) else "dropped: %s" % dict(dropped)


if __name__ == "__main__":
    sys.exit(tcp_test.main(check))
