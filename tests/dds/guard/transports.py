#!/usr/bin/python3
"""transports.py DDS_PEER PROFILES
A gateway and a client find each other through the guard over every transport that a profile can name: built-in ones,
UDPv4, shared memory, TCPv4. A second client comes and goes meanwhile. Nothing is dropped, and all end when told to."""

import os
import re
import sys
import tempfile

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import mutate  # noqa: E402

USED = re.compile(r"<userTransports>.*?</userTransports>\s*<useBuiltinTransports>false</useBuiltinTransports>", re.S)
TCP = """<transport_descriptor><transport_id>tcp</transport_id><type>TCPv4</type>%s</transport_descriptor>
    </transport_descriptors>"""


def use(name):
    return "<userTransports><transport_id>%s</transport_id></userTransports><useBuiltinTransports>false</useBuiltinTransports>" % name


def tcp(text, listening, locator, domain):
    """The gateway listens, the client connects."""
    port = 20000 + domain
    address = "<locator><tcpv4><physical_port>%d</physical_port><port>%d</port><address>127.0.0.1</address></tcpv4></locator>" % (
        port, 7410 + 250 * domain)
    ports = "<listening_ports><port>%d</port></listening_ports>" % port if listening else ""
    text = text.replace("</transport_descriptors>", TCP % ports, 1)
    text = USED.sub(use("tcp"), text, count=1)
    return text.replace("<builtin>", "<builtin><%s>%s</%s>" % (locator, address, locator), 1)


def profiles(text, transport, domain):
    """Of the gateway and of a client."""
    if transport == "built-in":
        text = USED.sub("<useBuiltinTransports>true</useBuiltinTransports>", text, count=1)
    elif transport == "SHM":
        text = USED.sub(use("linegate_shm"), text, count=1)
    elif transport == "TCPv4":
        return (tcp(text, True, "metatrafficUnicastLocatorList", domain), tcp(text, False, "initialPeersList", domain))
    return text, text


def check(peer, text, transport):
    domain, held = mutate.own_domain()
    with tempfile.TemporaryDirectory() as folder:
        paths = []
        for role, profile in zip(("gateway", "subscriber"), profiles(text, transport, domain)):
            paths.append(os.path.join(folder, role + ".xml"))
            with open(paths[-1], "w") as out:
                out.write(profile)
        gateway = mutate.Peer(peer, "gateway", domain, paths[0])
        if not gateway.wait_for("ready", mutate.FOUND_WITHIN):
            return "the gateway does not start"
        clients = [mutate.Peer(peer, "subscriber", domain, paths[1]) for _ in range(2)]
        for client in clients:
            for word in ("line", "image", "event"):
                if not client.wait_for(word, mutate.FOUND_WITHIN):
                    return "a client receives no " + word
        if not all([client.end() for client in clients]):
            return "a client does not end"
        if not gateway.end():
            return "the gateway does not end"
    held.close()
    dropped = gateway.dropped + clients[0].dropped + clients[1].dropped
    return "dropped: %s" % dict(dropped) if dropped else None


def main():
    with open(sys.argv[2]) as source:
        text = source.read()
    failed = False
    for transport in ("UDPv4", "built-in", "SHM", "TCPv4"):
        wrong = check(sys.argv[1], text, transport)
        print("%s: %s" % (transport, wrong or "ok"))
        failed = failed or wrong is not None
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
