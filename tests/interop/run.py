#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Runs a Fast DDS gateway and a Cyclone DDS subscriber against each other, on loopback.

run.py DDS_PEER CYCLONE_PEER
"""

import os
import subprocess
import sys

CYCLONE = "file://" + os.path.join(os.path.dirname(os.path.abspath(__file__)), "cyclone.xml")

OUTPUT = (
    "output line=line1 client=cyclone group=2 layout=abc arming=3 watchdog=250000000 "
    "reactions=21 value=7:1234 bytes=64:100"
)


def main(dds_peer, cyclone_peer):
    domain = str(190 + os.getpid() % 10)  # lower numbers are used by tests/dds/own_domain.h
    gateway = subprocess.Popen(
        [dds_peer, "gateway", domain],
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
    )
    try:
        first = gateway.stdout.readline().strip()
        if first != "ready":
            return f"the gateway says: {first}"
        environment = dict(os.environ, CYCLONEDDS_URI=CYCLONE)
        stranger = subprocess.run([cyclone_peer, domain], env=environment, timeout=80)
        if stranger.returncode != 0:
            return f"cyclone_peer ended with {stranger.returncode}"
    finally:
        said = gateway.communicate(timeout=10)[0].splitlines()
    print("\n".join(dict.fromkeys(said)))
    if OUTPUT not in said:
        return f"the gateway did not say: {OUTPUT}"
    return None


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:3]))
