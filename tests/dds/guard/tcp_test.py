# SPDX-License-Identifier: Apache-2.0
"""The program of the tests over TCPv4: a gateway and clients in a network of their own."""

import os
import sys
import tempfile

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path[:0] = [HERE, os.path.join(HERE, "..", "..", "gateway", "cli")]
import mutate  # noqa: E402
import transports  # noqa: E402
from plant_process import INSIDE, in_a_network_of_its_own  # noqa: E402

DOMAIN = 7  # the only one in this network
WITHIN = 60  # s, for a condition


def start_gateway(peer, paths):
    """Returns None if it does not start."""
    gateway = mutate.Peer(peer, "gateway", DOMAIN, paths[0])
    return gateway if gateway.wait_for("ready", WITHIN) else None


def start_client(peer, paths, role="pdo_subscriber"):
    return mutate.Peer(peer, role, DOMAIN, paths[1])


def receives(client):
    return transports.receives(client, WITHIN)


def receives_pdos(client):
    return receives(client) and client.wait_for("pdo", WITHIN)


def main(check):
    """Calls check(peer, paths, *arguments), which returns what is wrong, or None. peer: the program DDS_PEER; paths: the
    profiles of the gateway and of a client; arguments: those behind PROFILES. Returns the exit code."""
    if sys.argv[-1] != INSIDE:
        in_a_network_of_its_own()
    peer, profiles, *arguments = sys.argv[1:-1]
    with open(profiles, encoding="utf-8") as source:
        text = source.read()
    with tempfile.TemporaryDirectory() as folder:
        wrong = check(peer, transports.write_profiles(folder, text, "TCPv4", DOMAIN), *arguments)
    print("TCPv4: %s" % (wrong or "ok"))
    return 1 if wrong else 0
