#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Routes over another gateway in a secured domain: the identity of the routes of hall-a decides what hall-b carries out.
An engineer reads and writes, an operator reads; the access of a line to one certificate, a line that the permissions do not
name, and a revoked identity are refused, and hall-b names the certificate in its events and its journal. EMCYs pass (`emcy:
true`) with both roles, until the identity is revoked.

peer_rights.py LINEGATED LINEGATE PROFILES PROCESS   PROCESS: of the DDS of hall-a, same or own
"""

import contextlib
import json
import os
import signal
import subprocess

from peer_emcys import Passage, Watched
from plant_process import EDS, Failure, PATIENCE, end, expect, run_test, stop, until, write
from secured import Secured

BUS_A, BUS_B = ("239.74.163.25", 43135), ("239.74.163.26", 43136)
IO = f"{{id: 5, name: io, eds: {EDS}/digital-io.eds}}"
DEVICE = f"simulate: [{{node: 5, profile: digital-io}}], nodes: [{IO}]"
PLANT_B = f"""schema: 1
gateway: {{name: hall-b}}
dds: {{security: identities/hall-b}}
journal: {{file: JOURNAL}}
lines:
  - {{name: press, interface: "simulated:", network_id: 7, access: all, {DEVICE}}}
  - {{name: mine, interface: "simulated:", network_id: 8, {DEVICE},
     access: {{commands: off, outputs: off, clients: {{engineer/routes-a: all}}}}}}
  - {{name: others, interface: "simulated:", network_id: 9, {DEVICE},
     access: {{commands: off, outputs: off, clients: {{engineer/anna: all, operator/routes-a: all}}}}}}
  - {{name: store, interface: "udp:{BUS_B[0]}:{BUS_B[1]}", network_id: 10, nodes: [{IO}]}}
"""
PLANT_A = f"""schema: 1
gateway: {{name: hall-a}}
dds: {{security: identities/hall-a, routes_security: identities/ROUTES, process: PROCESS}}
routes:
  - {{to: 7, via: hall-b/press}}
  - {{to: 8, via: hall-b/mine}}
  - {{to: 9, via: hall-b/others}}
  - {{to: 10, via: hall-b/store, emcy: true}}
lines:
  - {{name: hall, interface: "udp:{BUS_A[0]}:{BUS_A[1]}", network_id: 1, access: all,
     enter: [{{from: 10, services: [emcy]}}]}}
"""
LINES = ("hall-b/press", "hall-b/mine", "hall-b/others", "hall-b/store")
VENDOR = "47 4C 00 00"
NOT_PERMITTED, TIMEOUT = "local control", "SDO protocol timed out"


class Halls(Secured):
    """Two gateways and the authority of their identities."""

    def __init__(self, folder, linegated, linegate, profiles, process):
        super().__init__(folder, linegated, linegate, profiles)
        self.process = process
        self.emcys = Passage(Watched(BUS_B), Watched(BUS_A))

    def plant_a(self, routes, name="a.yaml"):
        text = PLANT_A.replace("ROUTES", routes).replace("PROCESS", self.process)
        return write(os.path.join(self.folder, name), text)

    def plant_b(self):
        return write(os.path.join(self.folder, "b.yaml"),
                     PLANT_B.replace("JOURNAL", os.path.join(self.folder, "journal.db")))

    def start(self, plant):
        log = open(f"{plant}.log", "a", encoding="utf-8")
        return subprocess.Popen([self.linegated, plant, "--dds-domain", self.domain, "--dds-profile", self.profiles],
                                stderr=log)

    @contextlib.contextmanager
    def running(self, plant):
        process = self.start(plant)
        try:
            yield process
        except BaseException:
            stop(process)
            with open(f"{plant}.log", encoding="utf-8") as log:
                print(f"{plant}:\n{log.read()}")
            raise
        end(process)

    def sdo(self, *words):
        """Repeats a command whose console the library did not authenticate."""
        def answered():
            told = self.ask("console", "--timeout", "10", "sdo", *words, wait=PATIENCE / 4)
            text = (told.stdout + told.stderr).strip()
            lost = "no gateway" in text or "no line" in text or "no answer" in text
            return None if lost else (text or "done")
        return until(f"an answer to {words}", answered)

    def reads(self, network):
        told = []

        def is_read():
            told.append(self.sdo("read", f"hall-a/{network}:5", "1018:01"))
            return VENDOR in told[-1]
        try:
            until(f"network {network} is read", is_read)
        except Failure as failure:
            raise Failure(f"{failure}: {told[-1:]}") from failure

    def is_refused(self, what, code, *words):
        told = self.sdo(*words)
        expect(f"{what}: {told}", code in told, True)

    def write(self, network, value):
        return self.sdo("write", f"hall-a/{network}:5", "6200:01", "u8", str(value))

    def value(self, line="press"):
        return self.sdo("read", f"hall-b/{line}:5", "6200:01", "u8")

    def texts(self, line, kind):
        told = until(f"events of {line}",
                     lambda: self.ask("console", "--json", "events", line, "--once", wait=PATIENCE).stdout)
        return [one["text"] for one in map(json.loads, told.splitlines()) if one["kind"] == kind]

    def replacements(self, plant):
        """How often the gateway has replaced a process with DDS after a revocation."""
        with open(f"{plant}.log", encoding="utf-8") as log:
            return log.read().count("is replaced: revoked.crl has changed")

    def renew(self, name, role, *lines):
        options = [word for line in lines for word in ("--line", line)]
        self.security("issue", self.identities, name, "--role", role, *options)


def an_engineer_reads_and_writes(halls):
    for network in (7, 8):
        halls.reads(network)
    expect("a write", halls.write(7, 17), "done")
    expect("the value", halls.value(), "17")
    expect("a write to a line that permits this certificate alone", halls.write(8, 18), "done")
    accepted = halls.texts("hall-b/press", "command-accepted")
    expect(f"one write of routes-a: {accepted}", ["routes-a (hall-a routes" in text for text in accepted], [True])
    history = halls.ask("console", "history", "hall-b/press", wait=PATIENCE).stdout
    expect(f"the journal has it: {history}", "routes-a (hall-a routes" in history, True)


def another_subject_is_refused(halls):
    """The line permits an engineer of another name, and this name in another role."""
    halls.is_refused("reads others", NOT_PERMITTED, "read", "hall-a/9:5", "1018:01")
    halls.is_refused("writes others", NOT_PERMITTED, "write", "hall-a/9:5", "6200:01", "u8", "1")
    refused = halls.texts("hall-b/others", "command-refused")
    expect(f"the refusals name it: {refused}", bool(refused) and all("routes-a" in text for text in refused), True)
    expect("uncertain writes", halls.texts("hall-a/hall", "routing-unanswered"), [])


def an_operator_reads_only(halls):
    halls.reads(7)
    before = halls.value()
    halls.is_refused("an operator writes", NOT_PERMITTED, "write", "hall-a/7:5", "6200:01", "u8", "99")
    halls.is_refused("a line of engineers", NOT_PERMITTED, "read", "hall-a/8:5", "1018:01")
    expect("the value", halls.value(), before)
    expect("uncertain writes", halls.texts("hall-a/hall", "routing-unanswered"), [])


def the_process_of_the_routes_is_renewed(halls, plant):
    """After revoked.crl has changed: a far gateway that is revoked is not authenticated again."""
    if halls.process == "same":
        return
    halls.security("revoke", halls.identities, "office")

    def replaced():
        with open(f"{plant}.log", encoding="utf-8") as log:
            text = log.read()
        return "DDS routes process" in text and "is replaced: revoked.crl has changed" in text.split("DDS routes process")[1]
    until("the process of the routes is replaced", replaced)
    halls.reads(7)


def a_revoked_identity_is_refused(halls):
    """While both gateways run. hall-b then replaces its DDS process and authenticates hall-a, but not its routes."""
    halls.emcys.wait("an EMCY passes with the identity of an engineer")
    before, plant_b = halls.value(), halls.plant_b()
    replaced = halls.replacements(plant_b)
    halls.security("revoke", halls.identities, "routes-a")

    def refused():
        told = halls.write(7, before)
        return NOT_PERMITTED in told or TIMEOUT in told
    until("a write is refused", refused)
    for value in range(100, 104):
        told = halls.write(7, value)
        expect(f"a write of a revoked identity: {told}", NOT_PERMITTED in told or TIMEOUT in told, True)
    until("hall-b has replaced its process", lambda: halls.replacements(plant_b) > replaced)
    expect("the value", halls.value(), before)  # so the process that replaces it works
    sent = [halls.emcys.try_one(0.5) for _ in range(10)]
    expect("EMCYs that pass with a revoked identity", [code for code, passed in sent if passed], [])


def identities_that_cannot_work_are_named(halls):
    """linegate check, linegated, and a reload while the gateway runs."""
    halls.renew("limited", "engineer", "hall-b/press", "hall-b/mine")
    for identity, what in (("limited", "does not permit requests to hall-b/others"),
                           ("office", "is of role viewer, which sends no requests"),
                           ("hall-a", "is of role gateway, which sends no requests")):
        plant = halls.plant_a(identity, "wrong.yaml")
        for words in ([halls.linegate, "check", plant], [halls.linegated, plant]):
            told = subprocess.run(words, capture_output=True, text=True, timeout=PATIENCE, check=False)
            expect(f"exit status of {words}: {told.stderr}", told.returncode, 2)
            expect(f"{words} says why: {told.stderr}", what in told.stderr, True)


def a_reload_needs_the_right(halls, plant, process):
    """Routes to a line that the identity does not name are refused, and the present ones remain."""
    with open(plant, encoding="utf-8") as file:
        text = file.read()
    write(plant, text.replace("hall-b/mine", "hall-b/other-line"))
    process.send_signal(signal.SIGHUP)

    def refused():
        with open(f"{plant}.log", encoding="utf-8") as log:
            return "does not permit requests to hall-b/other-line" in log.read()
    until("the reload is refused", refused)
    write(plant, text)
    halls.reads(8)


def test(folder, linegated, linegate, profiles, process):
    halls = Halls(folder, linegated, linegate, profiles, process)
    halls.security("init", halls.identities)
    for name in ("hall-a", "hall-b"):
        halls.security("issue", halls.identities, name, "--role", "gateway")
    halls.security("issue", halls.identities, "console", "--role", "engineer")
    halls.security("issue", halls.identities, "office", "--role", "viewer")
    identities_that_cannot_work_are_named(halls)
    halls.renew("routes-a", "engineer", *LINES)
    halls.renew("reader-a", "operator", *LINES)
    with halls.running(halls.plant_b()):
        with halls.running(halls.plant_a("reader-a")):
            an_operator_reads_only(halls)
            halls.emcys.wait("an EMCY passes with the identity of an operator")
        plant = halls.plant_a("routes-a")
        with halls.running(plant) as gateway:
            an_engineer_reads_and_writes(halls)
            another_subject_is_refused(halls)
            a_reload_needs_the_right(halls, plant, gateway)
            the_process_of_the_routes_is_renewed(halls, plant)
            a_revoked_identity_is_refused(halls)


if __name__ == "__main__":
    run_test(test, own_network=True)
