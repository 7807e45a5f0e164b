#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""`linegate doctor` in set-ups that are broken in one way each: it names the cause, with what it has seen, and nothing
else. Gateway, clients and doctor run on hosts of their own (network namespaces).

doctor.py LINEGATED LINEGATE FOREIGN_ENDPOINT CLOCK_SHIFT [SET-UP...]
"""

import concurrent.futures
import json
import os
import re
import subprocess
import time

from hosts import Host, await_ready, cable, firewall
from plant_process import Failure, PATIENCE, SOURCES, expect, run_test, until, write

DOMAIN = "7"
TIME = 8  # seconds of an observation
TOGETHER = 4  # set-ups at the same time
HALL, DESK = "10.77.0.1", "10.77.0.2"
PLANT = """schema: 1
gateway: {{name: {name}}}
dds: {{{dds}}}
lines:
  - name: press
    interface: "simulated:"
    simulate: [{{node: 8, profile: digital-io}}]
    nodes: [{{id: 8, name: io, eds: {eds}, heartbeat: 100ms}}]
"""
EDS = os.path.join(SOURCES, "bridges", "sim", "eds", "digital-io.eds")


class Setup:
    """A gateway on the host `hall`, and a person at the host `desk`."""

    def __init__(self, folder, linegated, linegate, foreign_endpoint=None, clock_shift=None):
        self.folder, self.linegated, self.linegate = folder, linegated, linegate
        self.foreign_endpoint, self.clock_shift = foreign_endpoint, clock_shift
        self.profiles = os.path.join(SOURCES, "deploy", "dds", "linegate-profiles.xml")
        self.hosts = []

    def host(self, name):
        self.hosts.append(Host(name))
        return self.hosts[-1]

    def connected(self):
        """The hosts hall and desk with a cable between them."""
        hall, desk = self.host("hall"), self.host("desk")
        cable(hall, desk)
        hall.address(f"{HALL}/24")
        desk.address(f"{DESK}/24")
        await_ready(hall, desk)
        return hall, desk

    def file(self, name, text):
        return write(os.path.join(self.folder, name), text)

    def changed_profile(self, name, *changes):
        """A copy of the profiles with texts replaced."""
        with open(self.profiles, encoding="utf-8") as file:
            text = file.read()
        for old, new in changes:
            if old not in text:
                raise Failure(f"the profiles have no {old}")
            text = text.replace(old, new, 1)
        return self.file(name, text)

    def gateway(self, host, domain=DOMAIN, profile=None, name="hall", dds="", **options):
        """Starts a gateway there, and waits until its interface to DDS is open."""
        plant = self.file(f"{name}-{len(host.programs)}.yaml", PLANT.format(name=name, eds=EDS, dds=dds))
        log = open(os.path.join(self.folder, "log"), "w", encoding="utf-8")
        program = host.start(self.linegated, plant, "--dds-domain", domain, "--dds-profile", profile or self.profiles,
                             stderr=log, **options)
        first = 7400 + 250 * int(domain) + 10

        def open_ports():
            if program.poll() is not None:
                raise Failure(f"the gateway ended with {program.returncode}")
            with open(f"/proc/{program.pid}/net/udp", encoding="utf-8") as file:
                return f":{first:04X} " in file.read()
        until("the gateway has its ports open", open_ports)
        return program

    def ask(self, host, *words, domain=DOMAIN, profile=None, wait=TIME, identity=None):
        options = [] if identity is None else ["--security", identity]
        return subprocess.run(host.words(self.linegate, "--domain", domain, "--profile", profile or self.profiles,
                                         "--wait", str(wait), *options, *words),
                              capture_output=True, text=True, timeout=4 * PATIENCE, check=False)

    def doctor(self, host, *words, **options):
        """Runs the doctor there. Returns its report."""
        told = self.ask(host, "--json", "doctor", *words, **options)
        if told.returncode not in (0, 1):
            raise Failure(f"doctor ended with {told.returncode}\n{told.stdout}{told.stderr}")
        report = json.loads(told.stdout)
        expect("exit status", told.returncode, 1 if report["findings"] else 0)
        return report

    def security(self, *words):
        told = subprocess.run([self.linegate, "security", *words], capture_output=True, text=True, check=False)
        expect(f"{words} {told.stderr}", told.returncode, 0)

    def foreign(self, host, topic, type_name, partition="-", qos="fits"):
        """Starts a foreign reader there."""
        program = host.start(self.foreign_endpoint, DOMAIN, self.profiles, topic, type_name, partition, qos,
                             stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        expect("the foreign program", program.stdout.readline(), "ready\n")

    def close(self):
        for host in self.hosts:
            host.close()


def finds(report, *wanted):
    """Fails unless the causes are exactly these pairs: a cause, and a pattern for its evidence."""
    found = [(one["cause"], "\n".join(one["seen"])) for one in report["findings"]]
    if len(found) != len(wanted) or any(
            cause != name or not re.search(pattern, seen)
            for (cause, seen), (name, pattern) in zip(found, wanted)):
        raise Failure(f"found {json.dumps(report, indent=1)}, not {wanted}")
    for one in report["findings"]:
        expect("each finding says what it means and what to do", bool(one["means"] and one["advice"]), True)


# --- the set-ups ------------------------------------------------------------------------------------------------------


def sound(setup):
    """Nothing is wrong: on the host of the gateway, and on another one."""
    hall, desk = setup.connected()
    setup.gateway(hall)
    for host in (desk, hall):
        report = setup.doctor(host, HALL)
        finds(report)
        expect("the gateway", [(one["gateway"], one["lines"]) for one in report["gateways"]], [("hall", 1)])
    told = setup.ask(desk, "doctor")
    expect("exit status", told.returncode, 0)
    expect("last line", told.stdout.splitlines()[-1], "no fault was found")


def other_domain(setup):
    hall, desk = setup.connected()
    setup.gateway(hall, domain="42")
    for host in (desk, hall):
        finds(setup.doctor(host), ("other-domain", r"gateway 'hall' from (10\.77\.0\.1|127\.0\.0\.1) .* in domain 42"))
    told = setup.ask(desk, "doctor")
    expect("exit status", told.returncode, 1)
    if "use --domain 42" not in told.stdout:
        raise Failure(told.stdout)


def no_gateway(setup):
    """Nothing can be observed but silence."""
    _, desk = setup.connected()
    finds(setup.doctor(desk), ("nothing-heard", "no DDS program on this host"))


def separated(setup, rule):
    """The hosts hall and desk, with a host between them that drops some datagrams."""
    hall, between, desk = setup.host("hall"), setup.host("between"), setup.host("desk")
    firewall(between, hall, desk, rule)
    hall.address(f"{HALL}/24")
    desk.address(f"{DESK}/24")
    await_ready(hall, between, desk)
    return hall, desk


def multicast_lost(setup):
    """The network does not carry multicast: seen only if the host of the gateway is named."""
    hall, desk = separated(setup, "multicast")
    setup.gateway(hall)
    finds(setup.doctor(desk), ("nothing-heard", "domains 0 to 232"))
    finds(setup.doctor(desk, HALL), ("multicast-lost", f"{HALL} answers by unicast"))


def multicast_off(setup):
    hall, desk = separated(setup, "multicast")
    setup.gateway(hall)
    desk.run("ip", "link", "set", "eth0", "multicast", "off")
    finds(setup.doctor(desk), ("multicast-off", f"interface eth0 with address {DESK} has no MULTICAST flag"))


def interface_down(setup):
    hall, desk = setup.connected()
    setup.gateway(hall)
    desk.run("ip", "link", "set", "eth0", "down")
    finds(setup.doctor(desk), ("interface-down", f"interface eth0 with address {DESK} is down"),
          ("no-interface", "loopback is the only interface"), ("multicast-off", "interface lo"))


def no_interface(setup):
    desk = setup.host("desk")
    desk.run("ip", "link", "set", "lo", "multicast", "on")
    finds(setup.doctor(desk), ("no-interface", "loopback is the only interface"))


def behind_a_firewall(setup):
    hall, desk = separated(setup, "unicast-udp")
    setup.gateway(hall)
    finds(setup.doctor(desk), ("firewall", f"its UDP ports {HALL}:9160 give no answer and no refusal"))


def no_route(setup):
    hall, desk = setup.host("hall"), setup.host("desk")
    cable(hall, desk)
    hall.address(f"{HALL}/24")
    desk.address("10.78.0.2/24")
    await_ready(hall, desk)
    setup.gateway(hall)
    finds(setup.doctor(desk), ("no-route", f"cannot be reached: {HALL}:9160 Network is unreachable"))


def wrong_peers(setup):
    """Hosts that are given: without a gateway, off, and unreachable."""
    hall, desk = setup.connected()
    setup.gateway(hall, domain="42")
    report = setup.doctor(desk, HALL, "10.99.0.1", "no-such-host")
    finds(report, ("other-domain", "hall"), ("peer-without-dds", f"{HALL} is reached, and no program answers"),
          ("peer-unreachable", "UDP to 10.99.0.1: Network is unreachable"), ("peer-unknown", "no-such-host"))


def wrong_peer_in_the_profile(setup):
    _, desk = setup.connected()
    profile = setup.changed_profile("peers.xml", ("<discovery_config>", """<initialPeersList>
        <locator><udpv4><address>10.77.0.9</address></udpv4></locator></initialPeersList><discovery_config>"""))
    cause = setup.doctor(desk, profile=profile)["findings"][0]
    expect("cause", cause["cause"] in ("peer-silent", "peer-unreachable"), True)
    expect("evidence", "10.77.0.9" in cause["seen"][0], True)


def qos_that_does_not_fit(setup):
    """The profile of the gateway was changed, and a foreign reader asks for another ownership."""
    hall, desk = setup.connected()
    with open(setup.profiles, encoding="utf-8") as file:
        text = file.read()
    start = text.index('<data_writer profile_name="linegate/v1/NodeState">')
    profile = setup.file("qos.xml", text[:start] + text[start:].replace("RELIABLE", "BEST_EFFORT", 1))
    setup.gateway(hall, profile=profile)
    setup.foreign(desk, "linegate/v1/LineState", "linegate::v1::LineState", qos="exclusive")
    report = setup.doctor(desk)
    report["findings"].sort(key=lambda one: one["seen"])
    finds(report,
          ("qos-mismatch", "topic linegate/v1/LineState, policy OWNERSHIP: the writer of gateway 'hall' offers SHARED, "
           "the reader of program 'viewer' on host desk requests EXCLUSIVE"),
          ("qos-mismatch", "topic linegate/v1/NodeState, policy RELIABILITY: the writer of gateway 'hall' offers "
           "BEST_EFFORT, the reader of this program requests RELIABLE"))


def another_type(setup):
    """Seen on the host of the gateway."""
    hall, desk = setup.connected()
    setup.gateway(hall)
    setup.foreign(desk, "linegate/v1/LineState", "linegate::v0::LineState")
    finds(setup.doctor(hall), ("type-mismatch", "the reader of program 'viewer' on host desk has type "
                               "linegate::v0::LineState, gateway 'hall' has type linegate::v1::LineState"))


def another_partition(setup):
    hall, desk = setup.connected()
    setup.gateway(hall, dds="partitions: true")
    setup.foreign(desk, "linegate/v1/LineState", "linegate::v1::LineState", partition="hall/pres")
    finds(setup.doctor(desk), ("partition-mismatch", "(?s)program 'viewer' on host desk is in 'hall/pres'.*'hall/press'"))


def images_by_multicast(setup):
    """Asked for, of a gateway that does not send them so, and of one that does: in the process of the lines and not."""
    hall, desk = setup.connected()
    usual = setup.gateway(hall)
    finds(setup.doctor(desk, "--multicast"), ("images-by-unicast", "gateway 'hall' does not send"))
    for process in ("same", "own"):
        hall.end(usual)
        usual = setup.gateway(hall, dds=f"fan_out: multicast, process: {process}")
        finds(setup.doctor(desk, "--multicast"))
        finds(setup.doctor(desk))


def images_by_multicast_lost(setup):
    hall, desk = separated(setup, "images")
    setup.gateway(hall, dds="fan_out: multicast")
    finds(setup.doctor(desk, "--multicast"), ("images-by-multicast-lost", "(?s)gateway 'hall' arrive.*UDP port 9151"))
    finds(setup.doctor(desk))


def one_name_twice(setup):
    hall, desk = setup.connected()
    setup.gateway(hall)
    setup.gateway(desk)
    finds(setup.doctor(desk), ("same-name", "(?s)on host hall.*on host desk|on host desk.*on host hall"))


def clocks_apart(setup):
    hall, desk = setup.connected()
    setup.gateway(hall, env={**os.environ, "LD_PRELOAD": setup.clock_shift, "CLOCK_SHIFT": "-100"})
    finds(setup.doctor(desk), ("clocks-differ", r"the clock of gateway 'hall' is (99|100)\.\d s behind"))


def too_many_participants(setup):
    """A program is accepted, the doctor is not."""
    hall, desk = setup.connected()
    setup.gateway(hall, dds="participants: 1")
    setup.foreign(desk, "linegate/v1/LineState", "linegate::v1::LineState")
    finds(setup.doctor(desk), ("not-answered", "an unused port of the same host is refused"))


def harmful_profile(setup):
    hall, desk = setup.connected()
    setup.gateway(hall)
    with open(setup.profiles, encoding="utf-8") as file:
        text = file.read()
    start = text.index('<data_writer profile_name="linegate/v1/LineState">')
    profile = setup.file("harmful.xml", text[:start] + text[start:].replace("TRANSIENT_LOCAL", "VOLATILE", 1))
    finds(setup.doctor(desk, profile=profile), ("profile", "harmful.xml:.*RELIABLE and VOLATILE"))
    listed = setup.changed_profile("listed.xml", ("<type>UDPv4</type>", "<type>UDPv4</type><interfaceWhiteList>"
                                                  "<address>192.168.7.3</address></interfaceWhiteList>"))
    report = setup.doctor(desk, profile=listed)
    expect("first cause", report["findings"][0]["cause"], "no-listed-interface")


def secured_on_one_side(setup):
    hall, desk = setup.connected()
    identities = os.path.join(setup.folder, "identities")
    setup.security("init", identities)
    setup.security("issue", identities, "hall", "--role", "gateway")
    setup.security("issue", identities, "desk", "--role", "viewer")
    secured = setup.gateway(hall, dds=f"security: {identities}/hall")
    # Fast DDS 2.9.1 does not authenticate every participant that joins late.
    until("no fault with an identity of the same authority",
          lambda: not setup.doctor(desk, identity=os.path.join(identities, "desk"))["findings"])
    finds(setup.doctor(desk), ("gateway-secured", "(?s)announces an identity.*without --security"))
    another_authority(setup, desk)
    hall.end(secured)
    setup.gateway(hall)
    finds(setup.doctor(desk, identity=os.path.join(identities, "desk")),
          ("gateway-not-secured", "(?s)announces no identity.*identities/desk"))


def another_authority(setup, desk):
    rogue = os.path.join(setup.folder, "rogue")
    setup.security("init", rogue)
    setup.security("issue", rogue, "desk", "--role", "viewer")
    finds(setup.doctor(desk, identity=os.path.join(rogue, "desk")), ("not-authenticated", "gateway 'hall'"))


SETUPS = (sound, other_domain, no_gateway, multicast_lost, multicast_off, interface_down, no_interface,
          behind_a_firewall, no_route, wrong_peers, wrong_peer_in_the_profile, qos_that_does_not_fit, another_type,
          another_partition, images_by_multicast, images_by_multicast_lost, one_name_twice, clocks_apart,
          too_many_participants, harmful_profile,
          secured_on_one_side)


def run_case(case, folder, *programs):
    """Returns the reason for which the case failed, or an empty text."""
    begin = time.monotonic()
    own = os.path.join(folder, case.__name__)
    os.mkdir(own)
    setup = Setup(own, *programs)
    try:
        case(setup)
    except Failure as failure:
        return f"{case.__name__}: {failure}\n"
    finally:
        setup.close()
        print(f"{case.__name__}: {time.monotonic() - begin:.1f} s", flush=True)
    return ""


def test(folder, linegated, linegate, foreign_endpoint, clock_shift, *names):
    """The set-ups mostly wait, and have nothing in common."""
    cases = [case for case in SETUPS if not names or case.__name__ in names]
    with concurrent.futures.ThreadPoolExecutor(TOGETHER) as pool:
        failures = list(pool.map(
            lambda case: run_case(case, folder, linegated, linegate, foreign_endpoint, clock_shift), cases))
    if any(failures):
        raise Failure("".join(failures))


if __name__ == "__main__":
    run_test(test, own_network=True)
