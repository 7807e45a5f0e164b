#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""flood.py LINEGATED LINEGATE DDS_PEER RTPS_FLOOD PROFILES [--secured] [--unguarded] [--only REASON] [--seconds N]
                 [--seed N] [--pause SECONDS] [--save FILE]
Sends mutated datagrams to a live linegated with a running line, and to a live client.

In a separate network namespace, a gateway has a line on a bus of udp:, with simulated devices that it boots, and
with numbered frames from another program; a client subscribes, and a console repeatedly reads, writes and
subscribes. rtps_flood mutates the datagrams that they exchange. Afterwards no numbered frame may be missing in the
recording of the line, the devices must be Operational, both processes must be alive, must not have grown, and must
end: the gateway on SIGTERM, the client at the end of its input; a new client must find the gateway.

--secured: a domain in which everything is encrypted. --unguarded: dds: {guard: off}; with --only REASON only
datagrams are sent that the guard would drop for that reason, so that any defect found is one that the rule prevents."""

import argparse
import os
import re
import signal
import subprocess
import sys
import tempfile
import threading
import time

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path[:0] = [os.path.join(HERE, "..", "..", "gateway", "cli"), os.path.join(HERE, "..", "guard")]
from plant_process import EDS, INSIDE, Console, Failure, in_a_network_of_its_own, simulated, write  # noqa: E402
from udp_bus import Bus  # noqa: E402
import mutate  # noqa: E402

DOMAIN = "7"  # the only domain in this network namespace
GROUP, PORT = "239.74.163.17", 43131
NUMBERED = 0x6A5  # an identifier that no CANopen service uses
PERIOD = 0.05  # 20 a second: a socket holds those of 10 s, in case the gateway does not run for so long
ENDS_WITHIN = 60
LEAST_SENT = 100
FOUND_WITHIN = 120
GROWTH_KB = 150_000
# With DDS-Security a participant keeps the key material that it sent to a console until the lease of the console has
# expired: about 120 kB, 1.6 MB with the address sanitizer.
VISIT_KB = 2000
PLANT = """schema: 1
gateway: {{name: hall, log: warning}}
dds: {{domain: {domain}, profile: {profiles}, guard: {guard}, memory: 2GB}}  # with a sanitizer
lines:
  - name: press
    interface: "udp:{group}:{port}"
    bit_rate: 1Mbit
    network_id: 1
    node_id: 127
    heartbeat: 200ms
    access: all
    record: {{file: {folder}/press.log, max_size: 1GB, files: 9}}
    nodes:
      - {{id: 8, name: io, eds: {eds}/digital-io.eds, heartbeat: 500ms}}
      - {{id: 10, name: analog, eds: {eds}/analog-io.eds, heartbeat: 500ms}}
"""
# Elements of DDS-Security: file or plugin.
SECURITY = (("auth.plugin", "builtin.PKI-DH"), ("access.plugin", "builtin.Access-Permissions"),
            ("crypto.plugin", "builtin.AES-GCM-GMAC"), ("auth.builtin.PKI-DH.identity_ca", "ca.crt"),
            ("auth.builtin.PKI-DH.identity_certificate", "{name}.crt"), ("auth.builtin.PKI-DH.private_key", "{name}.key"),
            ("access.builtin.Access-Permissions.permissions_ca", "ca.crt"),
            ("access.builtin.Access-Permissions.governance", "governance.smime"),
            ("access.builtin.Access-Permissions.permissions", "{name}.smime"))


def say(text):
    print(time.strftime("%H:%M:%S ") + text, flush=True)


def secured_profiles(text, folder, name):
    """Returns the profiles with the identity `name` of make-identities."""
    properties = ""
    for key, value in SECURITY:
        value = value.format(name=name)
        value = value if key.endswith("plugin") else f"file://{folder}/{value}"
        properties += f"<property><name>dds.sec.{key}</name><value>{value}</value></property>"
    policy = f"<propertiesPolicy><properties>{properties}</properties></propertiesPolicy>"
    at = text.index("<rtps>", text.index('<participant profile_name="linegate">')) + len("<rtps>")
    return write(os.path.join(folder, f"profiles-{name}.xml"), text[:at] + policy + text[at:])


class Numbers(threading.Thread):
    """Sends numbered frames on the bus."""

    def __init__(self):
        super().__init__(daemon=True)
        self.bus, self.sent, self.ended = Bus(GROUP, PORT), 0, threading.Event()

    def run(self):
        while not self.ended.wait(PERIOD):
            self.bus.send(NUMBERED, (self.sent + 1).to_bytes(8, "little"))
            self.sent += 1


class Asker(threading.Thread):
    """A console that repeatedly joins and leaves, and uses each service."""

    def __init__(self, console, pause):
        super().__init__(daemon=True)
        self.console, self.pause, self.done, self.failed, self.ended = console, pause, 0, [], threading.Event()

    def run(self):
        words = (["sdo", "read", "press:io", "1018:01"], ["lines"], ["write", "press", "io.6200:01", "0x55"], ["gateways"],
                 ["sdo", "read", "press:io", "1008:00"], ["image", "press"], ["events", "-n", "5", "--since", "1h"])
        while not self.ended.is_set():
            for each in words:
                told = self.console.ask(*each) if not self.ended.is_set() else None
                if told is not None and told.returncode in (0, 4):  # the PDO waits for its other value
                    self.done += 1
                elif told is not None:
                    self.failed.append(" ".join(each) + ": %d %s" % (told.returncode, (told.stderr or told.stdout).strip()[:200]))
                self.ended.wait(self.pause)


def without_room():
    """Returns the number of datagrams dropped because a socket of the bus was full: the kernel did not run the
    gateway."""
    with open("/proc/net/udp", encoding="ascii") as sockets:
        return sum(int(line.split()[-1]) for line in list(sockets)[1:] if line.split()[1].endswith(":%04X" % PORT))


def children(pid):
    try:
        with open(f"/proc/{pid}/task/{pid}/children", encoding="ascii") as file:
            return [int(one) for one in file.read().split()]
    except OSError:
        return []


def kilobytes(process):
    """Returns the resident memory of the process and of its children: the gateway's DDS process is one."""
    total = 0
    for pid in [process.pid, *children(process.pid)]:
        try:
            with open(f"/proc/{pid}/status", encoding="ascii") as status:
                total += next((int(line.split()[1]) for line in status if line.startswith("VmRSS")), 0)
        except OSError:
            continue
    return total


class Run:
    def __init__(self, options, folder):
        self.options, self.folder, self.found = options, folder, []
        gateway = client = options.profiles
        if options.secured:
            subprocess.run([os.path.join(HERE, "..", "guard", "make-identities"), folder], check=True)
            with open(options.profiles, encoding="utf-8") as source:
                text = source.read()
            gateway, client = (secured_profiles(text, folder, name) for name in ("gateway", "operator"))
        plant = write(os.path.join(folder, "plant.yaml"), PLANT.format(
            domain=DOMAIN, profiles=gateway, guard="off" if options.unguarded else "on", group=GROUP, port=PORT,
            folder=folder, eds=EDS))
        self.client_profiles = client
        self.console = Console(options.linegate, client, DOMAIN)
        self.log = open(os.path.join(folder, "log"), "w+", encoding="utf-8")
        self.gateway = subprocess.Popen([options.linegated, plant], stderr=self.log)
        self.numbers = Numbers()

    def client(self):
        return mutate.Peer(self.options.peer, "subscriber", DOMAIN, self.client_profiles)

    def start(self):
        self.console.await_operational("press", 2)
        self.numbers.start()
        self.subscriber = self.client()
        if not self.subscriber.wait_for("image", FOUND_WITHIN):
            raise Failure("the client does not find the gateway")
        self.asker = Asker(self.console, self.options.pause)
        self.asker.start()

    def alive(self):
        return self.gateway.poll() is None and self.subscriber.alive()

    def flood(self):
        words = [self.options.flood, DOMAIN, "--seconds", str(self.options.seconds), "--seed", str(self.options.seed), "--count", str(self.options.count),
                 "--traffic", os.path.join(HERE, "..", "guard", "traffic.hex")]
        words += ["--protected"] if self.options.secured else []
        words += ["--only", self.options.only] if self.options.only else []
        words += ["--save", self.options.save] if self.options.save else []
        process = subprocess.Popen(words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        before, verdicts = None, {}
        for line in process.stdout:
            if " datagrams, by verdict: " in line:
                verdicts = dict(zip(line.split()[4::2], map(int, line.split()[5::2])))
            elif line.startswith("stuck"):
                self.found.append(line.strip())
            before = before or (kilobytes(self.gateway), kilobytes(self.subscriber.process))
            say(line.rstrip() + ("; gateway %d kB, client %d kB, console %d done, %d failed, numbered frames %d" % (
                kilobytes(self.gateway), kilobytes(self.subscriber.process), self.asker.done, len(self.asker.failed),
                self.numbers.sent) if line.startswith(("sent", "listening")) else ""))
            if not self.alive():
                process.stdin.close()
        if process.wait() != 0:
            self.found.append(f"rtps_flood ended with {process.returncode}")
        self.judge_census(verdicts)
        if before is None:
            return
        after = (kilobytes(self.gateway), kilobytes(self.subscriber.process))
        say("gateway %d kB before, %d after; client %d before, %d after" % (before[0], after[0], before[1], after[1]))
        for name, old, new in zip(("gateway", "client"), before, after):
            if new - old > GROWTH_KB + (VISIT_KB * (self.asker.done + len(self.asker.failed)) if self.options.secured else 0):
                self.found.append(f"the {name} grew from {old} to {new} kB")

    def judge_census(self, verdicts):
        sent = sum(verdicts.values())
        if sent < LEAST_SENT:
            self.found.append(f"{sent} datagrams were sent, at least {LEAST_SENT} are a test")
        if not self.options.only and verdicts.get("none", 0) == 0:
            self.found.append("no datagram passed the guard's rules")

    def judge(self):
        self.asker.ended.set()
        for name, process in (("gateway", self.gateway), ("client", self.subscriber.process)):
            if process.poll() is not None:
                self.found.append(f"the {name} ended with {process.returncode}")
        if self.gateway.poll() is None:
            late = self.client()
            if not late.wait_for("image", FOUND_WITHIN):
                self.found.append("a new client does not find the gateway")
            elif not self.options.unguarded:
                say(self.console.text("gateways"))
            late.end()
        self.asker.join(600)
        say("console: %d done, %d failed" % (self.asker.done, len(self.asker.failed)))
        if self.asker.done == 0:
            self.found.append("no command of the console was answered")
        for text in self.asker.failed[:20]:
            say("  " + text)
        say("client dropped: " + ", ".join("%s %d" % one for one in sorted(self.subscriber.dropped.items())))
        self.numbers.ended.set()
        self.numbers.join()
        time.sleep(2)  # until pending frames are recorded
        say("the sockets of the bus had no room for %d frames" % without_room())
        self.end(self.subscriber.process, "client", lambda: self.subscriber.process.stdin.close())
        self.end(self.gateway, "gateway", lambda: self.gateway.send_signal(signal.SIGTERM))
        self.judge_recording()
        self.judge_dds_process()
        self.print_log("ERROR: |runtime error|Assert|SUMMARY|lost|drop")

    def print_log(self, wanted):
        self.log.seek(0)
        for line in self.log:
            if re.search(wanted, line):
                say("log: " + line.rstrip()[:300])

    def end(self, process, name, how):
        if process.poll() is not None:
            return
        how()
        try:
            if process.wait(ENDS_WITHIN) != 0:
                self.found.append(f"the {name} ended with {process.returncode}")
        except subprocess.TimeoutExpired:
            self.found.append(f"the {name} does not end")
            process.kill()
            process.wait()

    def judge_dds_process(self):
        """The gateway starts its DDS process again when it ends or hangs: the log has it."""
        self.log.seek(0)
        ends = [line.strip() for line in self.log if re.search(r"the DDS process \d+ ", line)]
        self.found += [text[:300] for text in ends[:5]]
        if len(ends) > 5:
            self.found.append(f"{len(ends) - 5} further ends of the DDS process")

    def judge_recording(self):
        numbers = []
        for name in sorted((one for one in os.listdir(self.folder) if one.startswith("press.log")), reverse=True):
            with open(os.path.join(self.folder, name), encoding="ascii", errors="replace") as recording:
                for line in recording:
                    if f" {NUMBERED:03X}#" in line:
                        numbers.append(int.from_bytes(bytes.fromhex(line.split("#")[1].split()[0]), "little"))
        say("numbered frames: %d sent, %d recorded" % (self.numbers.sent, len(numbers)))
        if numbers != list(range(1, self.numbers.sent + 1)):
            self.found.append("%d of %d numbered frames are missing, or out of order" % (
                self.numbers.sent - len(set(numbers)), self.numbers.sent))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name in ("linegated", "linegate", "peer", "flood", "profiles"):
        parser.add_argument(name, type=os.path.abspath)
    parser.add_argument("--secured", action="store_true")
    parser.add_argument("--unguarded", action="store_true")
    parser.add_argument("--only")
    parser.add_argument("--seconds", type=int, default=20)
    parser.add_argument("--count", type=int, default=2**63, help="datagrams at most")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--pause", type=float, default=1.0, help="seconds between the console's commands")
    parser.add_argument("--save", help="file for the last datagrams")
    if sys.argv[-1] != INSIDE:
        in_a_network_of_its_own()
    options = parser.parse_args(sys.argv[1:-1])
    with tempfile.TemporaryDirectory() as folder:
        run = Run(options, folder)
        try:
            with simulated(options.linegate, f"udp:{GROUP}:{PORT}", {8: "digital-io", 10: "analog-io"}):
                run.start()
                run.flood()
                run.judge()
        except Failure as failure:
            run.found.append(str(failure))
            run.print_log(".")
        finally:
            for process in (run.gateway, getattr(run, "subscriber", run.gateway)):
                process = getattr(process, "process", process)
                if process.poll() is None:
                    process.kill()
    for text in run.found:
        say("found: " + text)
    return 1 if run.found else 0


if __name__ == "__main__":
    sys.exit(main())
