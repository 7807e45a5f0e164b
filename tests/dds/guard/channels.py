#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""channels.py DDS_PEER PROFILES
Sending never opens a channel twice: 100 clients join and leave, half of them by being killed, while an interface
gets and loses addresses, over UDPv4 and over TCPv4. Afterwards the gateway must have as many sockets and descriptors
as before, with one client in both cases, and a new client must receive. Runs in a separate network namespace."""

import collections
import os
import subprocess
import sys
import tempfile

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path[:0] = [HERE, os.path.join(HERE, "..", "..", "gateway", "cli")]
import mutate  # noqa: E402
import transports  # noqa: E402
from plant_process import INSIDE, in_a_network_of_its_own  # noqa: E402

CLIENTS, AT_ONCE = 100, 10
DOMAIN = 7  # the only domain in this network namespace
WITHIN = 60  # time limit of a condition, in s


def ip(words):
    subprocess.run(["ip", *words.split()], check=True)


def descriptors(process):
    """Returns the number of descriptors by kind: "socket", "anon_inode" and the like."""
    found = collections.Counter()
    folder = "/proc/%d/fd" % process.pid
    for name in os.listdir(folder):
        try:
            found[os.readlink(os.path.join(folder, name)).split(":")[0]] += 1
        except OSError:  # closed meanwhile
            pass
    return found


def client(peer, profile):
    out = mutate.Peer(peer, "subscriber", DOMAIN, profile)
    return out if transports.receives(out, WITHIN) else None


def change_address(change):
    ip("address %s 10.9.8.1/24 dev lo" % change)


def come_and_go(peer, profile, transport, turn):
    """Runs AT_ONCE clients, of which the second half is killed. Every second time, UDP clients start with the other
    address. TCP clients do not: Fast DDS 2.9.1 reads the addresses of its host once, and takes a later one for that
    of another host. Returns what went wrong, or None."""
    early = transport == "UDPv4" and turn % 2 == 0
    if early:
        change_address("add")
    clients = [mutate.Peer(peer, "subscriber", DOMAIN, profile) for _ in range(AT_ONCE)]
    deaf = ["client %d received only %s, dropped %s" % (number, dict(one.lines), dict(one.dropped)) for number, one in enumerate(clients)
            if not transports.receives(one, WITHIN)]
    if not early:
        change_address("add")
    endless = []
    for number, one in enumerate(clients):
        if number >= AT_ONCE / 2:
            one.process.kill()
            one.process.wait()
        elif not one.end():
            endless.append("client %d ended with %s" % (number, one.process.returncode))
    change_address("del")
    return "; ".join(deaf + endless) or None


def check(peer, text, transport):
    with tempfile.TemporaryDirectory() as folder:
        paths = transports.write_profiles(folder, text, transport, DOMAIN)
        gateway = mutate.Peer(peer, "gateway", DOMAIN, paths[0])
        if not gateway.wait_for("ready", WITHIN):
            return "the gateway does not start"
        stays = client(peer, paths[1])
        if stays is None:
            return "the first client does not receive"
        before = descriptors(gateway.process)
        for turn in range(CLIENTS // AT_ONCE):
            wrong = come_and_go(peer, paths[1], transport, turn)
            if wrong is not None:
                return "turn %d: %s; the gateway dropped %s" % (turn, wrong, dict(gateway.dropped))
        if not transports.eventually(lambda: not descriptors(gateway.process) - before):
            return "the gateway had %s, and has %s" % (dict(before), dict(descriptors(gateway.process)))
        print("%s: %s before %d clients, %s after them" % (
            transport, dict(before), CLIENTS, dict(descriptors(gateway.process))))
        late = client(peer, paths[1])
        if late is None:
            return "a new client does not receive"
        if not all([one.end() for one in (late, stays, gateway)]):
            return "a process does not end"
    return None


def main():
    if sys.argv[-1] != INSIDE:
        in_a_network_of_its_own()
    with open(sys.argv[2], encoding="utf-8") as source:
        text = source.read()
    failed = False
    for transport in ("UDPv4", "TCPv4"):
        wrong = check(sys.argv[1], text, transport)
        print("%s: %s" % (transport, wrong or "ok"))
        failed = failed or wrong is not None
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
