#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Gateways and consoles that are given interfaces and peers, without a file of profiles, on hosts of their own.

networks.py LINEGATED LINEGATE
"""

import os
import subprocess

from doctor import DESK, DOMAIN, HALL, Setup, finds, separated
from hosts import await_ready, cable
from plant_process import PATIENCE, expect, run_test

OFFICE = "10.79.0.2"


def sees(setup, host, *options):
    """Whether a console there sees the line."""
    told = setup.ask(host, *options, "lines", wait=PATIENCE)
    return told.returncode == 0 and "press" in told.stdout


def a_peer_of_the_console(setup):
    hall, desk = separated(setup, "multicast")
    setup.gateway(hall)
    expect("the console sees the line", sees(setup, desk, "--peer", HALL), True)
    finds(setup.doctor(desk, "--peer", HALL))


def a_peer_of_the_gateway(setup, process):
    hall, desk = separated(setup, "multicast")
    setup.gateway(hall, dds=f"peers: [{DESK}], process: {process}")
    expect("the console sees the line", sees(setup, desk), True)


def one_of_two_interfaces(setup, process):
    """The host of the gateway and one of the others see it."""
    hall, desk = setup.connected()
    office = setup.host("office")
    cable(hall, office, ("eth1", "eth0"))
    hall.address("10.79.0.1/24", "eth1")
    office.address(f"{OFFICE}/24")
    await_ready(hall, office)
    setup.gateway(hall, dds=f"interfaces: [eth0], process: {process}")
    expect("the desk sees the line", sees(setup, desk), True)
    expect("the console on the host of the gateway sees it", sees(setup, hall), True)
    finds(setup.doctor(office), ("nothing-heard", "no gateway announced itself"))
    expect("a console on the interface with that address", sees(setup, desk, "--interface", DESK), True)


def mistakes_are_named(setup):
    hall, _ = setup.connected()
    for options, reason in ((("--interface", "eth7"), "there is no interface eth7 with an IPv4 address"),
                            (("--peer", "no-such-host"), "the peer no-such-host has no IPv4 address")):
        told = setup.ask(hall, *options, "lines")
        expect(f"exit status, {told.stderr}", told.returncode, 1)
        expect("reason", reason in told.stderr, True)
    report = setup.doctor(hall, "--interface", "eth7")
    expect("the first cause", report["findings"][0]["cause"], "no-participant")
    plant = setup.file("wrong.yaml", "schema: 1\ndds: {interfaces: [eth7]}\nlines:\n"
                                     "  - {name: press, interface: 'simulated:'}\n")
    told = subprocess.run(hall.words(setup.linegated, plant, "--dds-domain", DOMAIN), capture_output=True, text=True,
                          timeout=PATIENCE, check=False)
    expect("the gateway does not start", told.returncode != 0, True)
    expect(f"reason, {told.stderr}", "there is no interface eth7" in told.stderr, True)


def test(folder, linegated, linegate):
    for number, (case, *arguments) in enumerate((
            (a_peer_of_the_console,), (a_peer_of_the_gateway, "same"), (a_peer_of_the_gateway, "own"),
            (one_of_two_interfaces, "same"), (one_of_two_interfaces, "own"), (mistakes_are_named,))):
        own = os.path.join(folder, str(number))
        os.mkdir(own)
        setup = Setup(own, linegated, linegate)
        try:
            case(setup, *arguments)
        finally:
            setup.close()


if __name__ == "__main__":
    run_test(test, own_network=True)
