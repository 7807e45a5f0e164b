#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""A firewall of its own host, for kernels without nftables: passes Ethernet frames between two interfaces, except those
that its rule drops.

firewall.py INTERFACE INTERFACE RULE   RULE: unicast-udp, multicast, images (by multicast),
                                       loss=PERCENT (of UDP, at random), or none
firewall.py --checksums INTERFACE      on a host behind it: computes checksums, which the firewall does not
"""

import array
import fcntl
import random
import select
import socket
import struct
import sys

ALL_FRAMES = 0x0003  # ETH_P_ALL
OUTGOING = 4  # PACKET_OUTGOING
IPV4, UDP = b"\x08\x00", 17
IMAGES = bytes((239, 255, 76, 71))
RANDOM = random.Random(1)  # for the losses
SIOCETHTOOL, ETHTOOL_STXCSUM = 0x8946, 0x00000017


def is_dropped(frame, rule):
    """Whether the rule drops this frame."""
    if rule == "none" or frame[12:14] != IPV4 or frame[23] != UDP:
        return False
    if rule.startswith("loss="):
        return RANDOM.random() * 100 < float(rule[5:])
    if rule == "images":
        return frame[30:34] == IMAGES
    multicast = 224 <= frame[30] <= 239  # first octet of the destination
    return multicast if rule == "multicast" else not multicast


def compute_checksums(name):
    """Between two veth interfaces, the kernel leaves them out."""
    off = array.array("B", struct.pack("II", ETHTOOL_STXCSUM, 0))
    request = struct.pack("16sP", name.encode(), off.buffer_info()[0]).ljust(40, b"\0")
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as any_socket:
        fcntl.ioctl(any_socket, SIOCETHTOOL, request)


def main():
    if sys.argv[1] == "--checksums":
        compute_checksums(sys.argv[2])
        return
    rule = sys.argv[3]
    ports = []
    for name in sys.argv[1:3]:
        port = socket.socket(socket.AF_PACKET, socket.SOCK_RAW, socket.htons(ALL_FRAMES))
        port.bind((name, 0))
        ports.append(port)
    print("ready", flush=True)
    while True:
        for port in select.select(ports, [], [])[0]:
            try:
                frame, sender = port.recvfrom(65536)
            except OSError:
                continue  # its interface is down
            if sender[2] == OUTGOING or is_dropped(frame, rule):
                continue
            try:
                ports[1 - ports.index(port)].send(frame)
            except OSError:
                pass  # the other end is down


if __name__ == "__main__":
    main()
