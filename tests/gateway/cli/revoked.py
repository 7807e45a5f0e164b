#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""A running gateway ends the access of an identity that is revoked, and of one that expires: subscribers with them
receive no event any more, others receive each, and each CAN frame is recorded.

revoked.py LINEGATED LINEGATE PROFILES
"""

import contextlib
import json
import os
import re
import subprocess
import threading
import time

from plant_process import EDS, Failure, end, expect, run_test, simulated, stop, until, write
from secured import Secured
from udp_bus import Bus, pause

GROUP, PORT = "239.74.163.17", 43127
LIFE = 45       # seconds of the identity that expires: it subscribes before
LIMIT = 60      # seconds within which access ends
COUNTER = 0x7A0  # identifier of the numbered frames, of no CANopen service
PLANT = f"""schema: 1
gateway: {{name: plant}}
dds: {{security: identities/plant}}
lines:
  - name: press
    interface: "udp:{GROUP}:{PORT}"
    access: all
    record: RECORD
    nodes: [{{id: 8, name: io, eds: {EDS}/digital-io.eds, heartbeat: 100ms}}]
"""
CA = """[ca]
default_ca = plant
[plant]
database = index
serial = serial
new_certs_dir = .
default_md = sha256
policy = any
x509_extensions = identity
[any]
organizationName = supplied
organizationalUnitName = supplied
commonName = supplied
[identity]
basicConstraints = critical,CA:FALSE
"""


class Frames:
    """Sends numbered frames to the bus until the end."""

    def __init__(self, bus):
        self.sent, self.ended = 0, threading.Event()
        self.thread = threading.Thread(target=self.run, args=(bus,))
        self.thread.start()

    def run(self, bus):
        while not self.ended.is_set():
            bus.send(COUNTER, self.sent.to_bytes(4, "big"))
            self.sent += 1
            pause(0.005)

    def end(self):
        self.ended.set()
        self.thread.join()


class Subscriber:
    """A console that prints each event. One that the library does not authenticate is started again."""

    def __init__(self, secured, identity):
        self.name, self.events = identity, []
        options = ["--security", os.path.join(secured.identities, identity)]
        self.process = subprocess.Popen(
            [secured.linegate, "--profile", secured.profiles, "--domain", secured.domain, "--wait", "10", *options,
             "--json", "events", "press"], stdout=subprocess.PIPE, text=True)
        threading.Thread(target=self.read, daemon=True).start()

    def read(self):
        for line in self.process.stdout:
            document = json.loads(line)
            if document.get("line") == "press" and "number" in document:
                self.events.append(document)

    def last(self):
        """The number of the newest event; 0: none was received."""
        return max((event["number"] for event in self.events), default=0)


def subscribed(secured, identity):
    def connected():
        subscriber = Subscriber(secured, identity)
        for _ in range(60):
            if subscriber.last() != 0:
                return subscriber
            pause(0.1)
        stop(subscriber.process)
        return None
    return until(f"{identity} receives events", connected)


def issue_for_seconds(secured, name, seconds):
    """A certificate that `linegate security issue` would not make: its shortest life is a day."""
    secured.security("issue", secured.identities, name, "--role", "viewer")
    identity = os.path.join(secured.identities, name)
    work = os.path.join(secured.folder, "ca")
    os.mkdir(work)
    write(os.path.join(work, "ca.conf"), CA)
    write(os.path.join(work, "index"), "")
    write(os.path.join(work, "serial"), "77")
    last = time.time() + seconds
    stamp = time.strftime("%Y%m%d%H%M%SZ", time.gmtime(last))
    subprocess.run(["openssl", "req", "-new", "-key", f"{identity}/identity.key", "-subj",
                    f"/O=linegate/OU=viewer/CN={name}", "-out", "request"], cwd=work, check=True)
    subprocess.run(["openssl", "ca", "-batch", "-notext", "-config", "ca.conf", "-in", "request", "-out", "made",
                    "-enddate", stamp, "-cert", f"{secured.identities}/ca.crt", "-keyfile",
                    f"{secured.identities}/ca.key"], cwd=work, check=True, capture_output=True)
    os.replace(f"{work}/made", f"{identity}/identity.crt")
    return last


def log_of(secured):
    with open(os.path.join(secured.folder, "log"), encoding="utf-8") as log:
        return log.read()


def until_replaced(secured, reason, since):
    """Waits for the replacement; fails if it comes later than LIMIT after `since`."""
    while log_of(secured).count(f"is replaced: {reason}") == 0:
        if time.time() - since > LIMIT:
            raise Failure(f"not replaced within {LIMIT} s: {reason}\n{log_of(secured)}")
        pause(0.2)
    print(f"{reason}: replaced after {time.time() - since:.1f} s")


def cause_event(secured):
    secured.until_it_ends("engineer", ["nmt", "start", "press:8"], True)


def others_receive(secured, remaining, excluded):
    """Events after the replacement reach the subscribers that remain, and not the excluded ones."""
    before = [one.last() for one in remaining]
    of_excluded = [len(one.events) for one in excluded]

    def received():
        cause_event(secured)
        pause(0.5)
        return all(one.last() > last for one, last in zip(remaining, before))
    until("the other subscribers receive the next events", received)
    for one, count in zip(excluded, of_excluded):
        expect(f"events that {one.name} received afterwards", one.events[count:], [])


def check_frames(record, sent):
    with open(record, encoding="ascii") as file:
        found = [int(one, 16) for one in re.findall(rf" {COUNTER:X}#([0-9A-F]{{8}})", file.read())]
    print(f"{sent} frames sent, {len(found)} recorded")
    expect("numbers of the recorded frames", found, list(range(found[0], found[0] + len(found))))
    expect("the last recorded frame", found[-1], sent - 1)


def run(secured, bus):
    with contextlib.ExitStack() as ended:
        return with_subscribers(secured, bus, ended)


def with_subscribers(secured, bus, ended):
    """ended: ends the subscribers. One that is left would keep the output of the test open until its time-out."""
    def subscriber(identity):
        one = subscribed(secured, identity)
        ended.callback(stop, one.process)
        return one

    office = subscriber("office")
    victor = subscriber("victor")
    last = issue_for_seconds(secured, "temp", LIFE)
    temp = subscriber("temp")
    expect("it has not expired yet", time.time() < last, True)
    frames = Frames(bus)
    try:
        secured.security("revoke", secured.identities, "victor")
        until_replaced(secured, "revoked.crl has changed", time.time())
        others_receive(secured, [office, temp], [victor])
        while time.time() <= last:
            pause(0.5)
        until_replaced(secured, "the certificate of a participant has expired", last)
        others_receive(secured, [office], [victor, temp])
    finally:
        frames.end()
    # A new writer sends the last events again, with their numbers.
    numbers = sorted({event["number"] for event in office.events})
    expect("numbers of the events", numbers, list(range(1, numbers[-1] + 1)))
    return frames.sent


def test(folder, linegated, linegate, profiles):
    secured = Secured(folder, linegated, linegate, profiles)
    secured.security("init", secured.identities)
    secured.security("issue", secured.identities, "plant", "--role", "gateway")
    secured.security("issue", secured.identities, "engineer", "--role", "engineer")
    for name in ("office", "victor"):
        secured.security("issue", secured.identities, name, "--role", "viewer")
    record = os.path.join(folder, "press.log")
    process = secured.gateway(write(os.path.join(folder, "plant.yaml"), PLANT.replace("RECORD", record)))
    try:
        with simulated(linegate, f"udp:{GROUP}:{PORT}", {8: "digital-io"}):
            sent = run(secured, Bus(GROUP, PORT))
            pause(1)
    except BaseException:
        stop(process)
        print(log_of(secured))
        raise
    end(process)
    check_frames(record, sent)


if __name__ == "__main__":
    run_test(test, own_network=True)
