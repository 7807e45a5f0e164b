#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Gateways and consoles that are given interfaces and peers, without a file of profiles, on hosts of their own.

networks.py LINEGATED LINEGATE
"""

import os
import subprocess

from doctor import DESK, DOMAIN, HALL, Setup, finds, separated
from hosts import await_ready, cable
from plant_process import Failure, PATIENCE, expect, run_test, until

OFFICE = "10.79.0.2"
SERVER_PORT = "11811"


def read(path):
    with open(path, encoding="utf-8") as file:
        return file.read()


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


def start_server(setup, desk, number="0"):
    """Starts a discovery server of Fast DDS there, which knows after a restart what it knew before."""
    server = desk.start("fast-discovery-server", "-i", number, "-l", DESK, "-p", SERVER_PORT, "-b",
                        stdout=subprocess.DEVNULL, cwd=setup.folder)

    def is_open():
        if server.poll() is not None:
            raise Failure(f"the discovery server ended with {server.returncode}")
        with open(f"/proc/{server.pid}/net/udp", encoding="utf-8") as file:
            return f":{int(SERVER_PORT):04X} " in file.read()
    until("the discovery server has its port open", is_open)
    return server


def a_discovery_server(setup, process):
    """It may end: who knows each other goes on, and who comes later waits for it."""
    hall, desk = separated(setup, "multicast")
    setup.gateway(hall, dds=f"discovery_servers: ['{DESK}'], process: {process}")
    silent = setup.doctor(desk, "--discovery-server", DESK)
    finds(silent, ("server-silent", "with ID 0 was not discovered"))
    server = start_server(setup, desk)
    expect("the console sees the line", sees(setup, desk, "--discovery-server", DESK), True)
    expect("on the host of the gateway, too", sees(setup, hall, "--discovery-server", f"0@{DESK}:{SERVER_PORT}"), True)
    told = setup.ask(desk, "--discovery-server", DESK, "sdo", "read", "press:io", "1000:00", wait=PATIENCE)
    expect(f"a command, {told.stderr}", told.returncode, 0)
    finds(setup.doctor(desk, "--discovery-server", DESK))
    finds(setup.doctor(desk), ("nothing-heard", "no gateway announced itself"))
    expect("by the variable of ROS 2", sees_by_variable(setup, desk, f"{DESK}:{SERVER_PORT}"), True)
    with open(os.path.join(setup.folder, "monitor"), "w+", encoding="utf-8") as seen:
        desk.start(setup.linegate, "--domain", DOMAIN, "--profile", setup.profiles, "--json", "--wait", str(PATIENCE),
                   "--discovery-server", DESK, "events", stdout=seen)
        until("the events follow", lambda: "boot" in read(seen.name))
        desk.end(server)
        told = setup.ask(desk, "--discovery-server", DESK, "lines", wait=1)
        expect("who comes now sees nothing", told.returncode, 1)
        server = start_server(setup, desk)
        told = setup.ask(desk, "--discovery-server", DESK, "sdo", "write", "press:io", "1017:00", "500", wait=PATIENCE)
        expect(f"the refusal, {told.stderr}", "not permitted" in told.stderr, True)
        until("the events go on", lambda: "refused" in read(seen.name))


def sees_by_variable(setup, host, servers, *options):
    told = subprocess.run(host.words(setup.linegate, "--domain", DOMAIN, "--profile", setup.profiles, "--wait",
                                     str(PATIENCE), *options, "lines"), env=dict(os.environ, ROS_DISCOVERY_SERVER=servers),
                          capture_output=True, text=True, timeout=4 * PATIENCE, check=False)
    return told.returncode == 0 and "press" in told.stdout


def a_gateway_that_is_not_at_the_server(setup):
    hall, desk = setup.connected()
    setup.gateway(hall)
    start_server(setup, desk, number="3")
    finds(setup.doctor(desk, "--discovery-server", f"3@{DESK}"), ("not-at-server", "announces itself by multicast"))


def mistakes_are_named(setup):
    hall, _ = setup.connected()
    for options, reason in ((("--interface", "eth7"), "there is no interface eth7 with an IPv4 address"),
                            (("--peer", "no-such-host"), "the peer no-such-host has no IPv4 address"),
                            (("--discovery-server", "no-such-host"),
                             "the discovery server no-such-host has no IPv4 address"),
                            (("--discovery-server", "256@10.0.0.1"), "is not [ID@]HOST[:PORT]"),
                            (("--discovery-server", "10.0.0.1", "--peer", "10.0.0.2"), "announces itself to no peers"),
                            (("--discovery-server", "10.0.0.1", "--multicast"), "are for networks without multicast")):
        told = setup.ask(hall, *options, "lines")
        expect(f"exit status, {told.stderr}", told.returncode, 1)
        expect("reason", reason in told.stderr, True)
    expect("peers beside the variable of ROS 2", sees_by_variable(setup, hall, "10.0.0.1", "--peer", "10.0.0.2"), False)
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
            (one_of_two_interfaces, "same"), (one_of_two_interfaces, "own"), (a_discovery_server, "same"), (a_discovery_server, "own"),
            (a_gateway_that_is_not_at_the_server,), (mistakes_are_named,))):
        own = os.path.join(folder, str(number))
        os.mkdir(own)
        setup = Setup(own, linegated, linegate)
        try:
            case(setup, *arguments)
        finally:
            setup.close()


if __name__ == "__main__":
    run_test(test, own_network=True)
