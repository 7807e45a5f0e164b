#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""transports.py DDS_PEER PROFILES
A gateway and a client find each other through the guard over every transport that a profile can name: the built-in
ones, UDPv4, UDPv6, shared memory, TCPv4. A second client joins and leaves meanwhile; over TCPv4 many did so before.
Each process must have received datagrams through its guard, the guard must have dropped none, and the process must
end with its input. UDPv6 needs the address ::1."""

import os
import re
import socket
import sys
import tempfile
import time

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import mutate  # noqa: E402

USED = re.compile(r"<userTransports>.*?</userTransports>\s*<useBuiltinTransports>false</useBuiltinTransports>", re.S)
OWN = """<transport_descriptor><transport_id>own</transport_id><type>%s</type>%s</transport_descriptor>
    </transport_descriptors>"""


ONE_AFTER_THE_OTHER = 20


def has_v6():
    try:
        with socket.socket(socket.AF_INET6, socket.SOCK_DGRAM) as probe:
            probe.bind(("::1", 0))
        return True
    except OSError:
        return False


def use(name):
    return "<userTransports><transport_id>%s</transport_id></userTransports><useBuiltinTransports>false</useBuiltinTransports>" % name


def tcp(text, listening, locator, domain):
    """Profiles for TCP: the gateway listens, the clients connect."""
    port = 20000 + domain
    address = "<locator><tcpv4><physical_port>%d</physical_port><port>%d</port><address>127.0.0.1</address></tcpv4></locator>" % (
        port, 7410 + 250 * domain)
    ports = "<listening_ports><port>%d</port></listening_ports>" % port if listening else ""
    text = text.replace("</transport_descriptors>", OWN % ("TCPv4", ports), 1)
    text = USED.sub(use("own"), text, count=1)
    return text.replace("<builtin>", "<builtin><%s>%s</%s>" % (locator, address, locator), 1)


def udp_v6(text, domain):
    """Profiles for UDPv6 without multicast, which the loopback interface supports only for IPv4: each participant
    looks for the first participants."""
    ports = range(7410 + 250 * domain, 7410 + 250 * domain + 8, 2)
    peers = "".join("<locator><udpv6><port>%d</port><address>::1</address></udpv6></locator>" % port for port in ports)
    text = text.replace("</transport_descriptors>", OWN % (
        "UDPv6", "<interfaceWhiteList><address>::1</address></interfaceWhiteList>"), 1)
    text = USED.sub(use("own"), text, count=1)
    return text.replace("<builtin>", "<builtin><initialPeersList>%s</initialPeersList>" % peers, 1)


def profiles(text, transport, domain):
    """Returns the profiles of the gateway and of a client."""
    if transport == "built-in":
        text = USED.sub("<useBuiltinTransports>true</useBuiltinTransports>", text, count=1)
    elif transport == "SHM":
        text = USED.sub(use("linegate_shm"), text, count=1)
    elif transport == "UDPv6":
        text = udp_v6(text, domain)
    elif transport == "TCPv4":
        return (tcp(text, True, "metatrafficUnicastLocatorList", domain), tcp(text, False, "initialPeersList", domain))
    return text, text


def write_profiles(folder, text, transport, domain):
    """Returns the paths of the profiles of the gateway and of a client, which it writes to that folder."""
    paths = []
    for role, profile in zip(("gateway", "subscriber"), profiles(text, transport, domain)):
        paths.append(os.path.join(folder, role + ".xml"))
        with open(paths[-1], "w", encoding="utf-8") as out:
            out.write(profile)
    return paths


def receives(client, seconds):
    return all(client.wait_for(word, seconds) for word in ("line", "image", "event"))


def eventually(condition, seconds=mutate.FOUND_WITHIN):
    end = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > end:
            return False
        time.sleep(0.05)
    return True


def start_clients(peer, domain, profile, transport):
    """Returns clients that are matched at the same time, or None if one receives nothing. Without OpeningChannel of
    tcp_input.h about one in twenty clients over TCP never received anything: that many join and leave before."""
    for _ in range(ONE_AFTER_THE_OTHER if transport == "TCPv4" else 0):
        client = mutate.Peer(peer, "subscriber", domain, profile)
        if not receives(client, mutate.FOUND_WITHIN) or not client.end():
            return None
    clients = [mutate.Peer(peer, "subscriber", domain, profile) for _ in range(2)]
    return clients if all([receives(client, mutate.FOUND_WITHIN) for client in clients]) else None


def check(peer, text, transport):
    domain, held = mutate.own_domain()
    with tempfile.TemporaryDirectory() as folder:
        paths = write_profiles(folder, text, transport, domain)
        gateway = mutate.Peer(peer, "gateway", domain, paths[0])
        if not gateway.wait_for("ready", mutate.FOUND_WITHIN):
            return "the gateway does not start"
        clients = start_clients(peer, domain, paths[1], transport)
        if clients is None:
            return "a client does not receive"
        if not all([client.end() for client in clients]):
            return "a client does not end"
        if not gateway.end():
            return "the gateway does not end"
    for process in (gateway, *clients):
        process.thread.join()  # until it has read all output
        if not process.lines["guarded"]:
            return "a process received nothing through its guard"
    held.close()
    dropped = gateway.dropped + clients[0].dropped + clients[1].dropped
    return "dropped: %s" % dict(dropped) if dropped else None


def main():
    with open(sys.argv[2]) as source:
        text = source.read()
    failed = False
    for transport in ("UDPv4", "UDPv6", "built-in", "SHM", "TCPv4"):
        if transport == "UDPv6" and not has_v6():
            print("UDPv6: left out, this machine does not have the address ::1")
            continue
        wrong = check(sys.argv[1], text, transport)
        print("%s: %s" % (transport, wrong or "ok"))
        failed = failed or wrong is not None
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
