#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""mutate.py DDS_PEER [--mode guarded|unguarded] [--seconds N] [--seed N] [--save FILE]
Sends mutated RTPS datagrams to a live gateway and a live client in a separate DDS domain.

The datagrams of traffic.hex were captured between a gateway (GUID prefix EEh) and clients (DDh); the prefixes are
replaced by those of the live participants. Mutations respect the structure: submessages, sequence numbers and sets,
fragments, parameter lists, CDR bodies. Afterwards both processes must be alive, must not have grown, a new client
must find the gateway, and all must end on request. Prints the sent datagrams by kind of submessage and by parameter,
and the datagrams that the guards dropped by reason, which shows whether any datagram reached the library.

--mode unguarded shows the behaviour of the library without a guard: the datagrams sent last are saved."""

import argparse
import collections
import os
import random
import socket
import struct
import subprocess
import sys
import threading
import time

HERE = os.path.dirname(os.path.abspath(__file__))
GATEWAY, CLIENT = b"\xee" * 12, b"\xdd" * 12
NUMBERS = [-(2**63), -1, 0, 1, 2, 255, 256, 4096, 60000, 2**20, 2**24, 2**31, 2**32 - 1, 2**32, 2**40, 2**48, 2**62, 2**63 - 1]
WORDS = [0, 1, 2, 3, 4, 7, 8, 16, 31, 32, 255, 256, 257, 1024, 2**15, 2**16, 2**24, 2**31 - 1, 2**31, 2**32 - 4, 2**32 - 1]
SHORTS = [0, 1, 2, 3, 4, 8, 15, 16, 17, 20, 28, 64, 255, 1024, 2**15 - 1, 2**15, 2**16 - 4, 2**16 - 1]
KINDS = [0x01, 0x06, 0x07, 0x08, 0x09, 0x0C, 0x0D, 0x0E, 0x0F, 0x12, 0x13, 0x15, 0x16, 0x30, 0x31, 0x32, 0x33, 0x34, 0x80, 0x81]
ENTITIES = [bytes.fromhex(e) for e in (
    "00000000 000100c2 000100c7 000002c2 000002c7 000003c2 000003c7 000004c2 000004c7 000200c2 000200c7 000201c3 "
    "000201c4 ff0003c2 ff0004c2 ff0200c2 ff0101c2 00000102 00000103 00000202 00000203 00000302 00000303 00000104 00000107").split()]
PARAMETERS = [0x02, 0x04, 0x05, 0x06, 0x07, 0x15, 0x16, 0x1A, 0x1B, 0x1D, 0x1E, 0x1F, 0x21, 0x23, 0x25, 0x27, 0x29, 0x2B,
              0x2C, 0x2D, 0x2E, 0x2F, 0x30, 0x31, 0x32, 0x33, 0x34, 0x35, 0x40, 0x41, 0x43, 0x44, 0x48, 0x49, 0x50, 0x52,
              0x53, 0x58, 0x59, 0x5A, 0x60, 0x62, 0x69, 0x70, 0x71, 0x72, 0x73, 0x74, 0x75, 0x76, 0x83, 0x1001, 0x1002,
              0x1003, 0x1004, 0x1005, 0x1006, 0x8000, 0x8001, 0x8002, 0x8003, 0x8005, 0x8006, 0x8007, 0x800F]
GROWTH_KB = 100_000
# The address sanitizer keeps freed memory, 256 MB unless limited, which would count as growth. When a TCP connection
# has ended, asio in Fast DDS 2.9 frees memory from aligned_alloc with delete.
SANITIZER = ("quarantine_size_mb=32", "alloc_dealloc_mismatch=0")
ENVIRONMENT = os.environ | {"ASAN_OPTIONS": ":".join(filter(None, (os.environ.get("ASAN_OPTIONS"), *SANITIZER)))}
ENDS_WITHIN = 60
FOUND_WITHIN = 60


def complain(text):
    print("mutate.py: " + text, file=sys.stderr)
    sys.exit(1)


# --- datagrams -----------------------------------------------------------------------------------


class Submessage:
    def __init__(self, kind, flags, body):
        self.kind, self.flags, self.body, self.length = kind, flags, bytearray(body), None

    def order(self):
        return "<" if self.flags & 1 else ">"

    def pack(self):
        length = len(self.body) if self.length is None else self.length
        return struct.pack(self.order() + "BBH", self.kind, self.flags, length & 0xFFFF) + bytes(self.body)


def split(datagram):
    out, at = [], 20
    while at + 4 <= len(datagram):
        kind, flags = datagram[at], datagram[at + 1]
        length = struct.unpack_from("<H" if flags & 1 else ">H", datagram, at + 2)[0]
        if length == 0 and kind not in (1, 9):
            length = len(datagram) - at - 4
        out.append(Submessage(kind, flags, datagram[at + 4 : at + 4 + length]))
        at += 4 + length
    return out


def put(random, body, at, order, form, values):
    size = struct.calcsize(form)
    if at + size > len(body):
        return
    old = struct.unpack_from(order + form, body, at)[0]
    value = random.choice(values + [old + 1, old - 1, old * 2])
    body[at : at + size] = struct.pack(order + form, value % 2 ** (8 * size))


def put_number(random, body, at, order):
    if at + 8 <= len(body):
        high, low = struct.unpack_from(order + "II", body, at)
        old = high << 32 | low
        value = random.choice(NUMBERS + [old + d for d in (1, 2, 10, 1000, 5000, 2**20)]) % 2**64
        body[at : at + 8] = struct.pack(order + "II", value >> 32, value & 0xFFFFFFFF)


def parameters_of(body, order):
    """Returns (offset, ID, length) of the parameters in the first list that is found in the body."""
    begin = 20 if body[2:4] in (b"\x10\0", b"\0\x10") else 32
    for start in (begin, begin + 4):
        found, at = [], start
        while at + 4 <= len(body):
            pid, length = struct.unpack_from(order + "HH", body, at)
            if pid == 1:
                if found:
                    return found
                break
            if at + 4 + length > len(body):
                break
            found.append((at, pid, length))
            at += 4 + length
    return []


def mutate_parameters(random, it):
    order, found = it.order(), parameters_of(it.body, it.order())
    if not found:
        return
    at, pid, length = random.choice(found)
    action = random.randrange(6)
    if action == 0:
        struct.pack_into(order + "H", it.body, at, random.choice(PARAMETERS))
    elif action == 1:
        put(random, it.body, at + 2, order, "H", SHORTS)
    elif action == 2 and length >= 4:
        put(random, it.body, at + 4 + 4 * random.randrange(length // 4), order, "I", WORDS)
    elif action == 3:
        del it.body[at : at + 4 + length]
    elif action == 4:
        it.body[at:at] = it.body[at : at + 4 + length]
    else:
        value = bytes(random.choice((0, 0, 1, 4, 255, random.randrange(256))) for _ in range(4 * random.randrange(12)))
        it.body[at:at] = struct.pack(order + "HH", random.choice(PARAMETERS), len(value)) + value


def mutate_fields(random, it):
    order, body = it.order(), it.body
    places = {0x06: ((8,), (16, -4), ()), 0x07: ((8, 16), (24,), ()), 0x08: ((8, 16), (24,), ()),
              0x12: ((8,), (16, 20), ()), 0x13: ((8,), (16,), ()), 0x15: ((12,), (), (0, 2)),
              0x16: ((12,), (20, 28), (2, 24, 26))}.get(it.kind)
    if places is None:
        if len(body) >= 4:
            put(random, body, 4 * random.randrange(len(body) // 4), order, "I", WORDS)
        return
    numbers, words, shorts = places
    choice = random.randrange(4)
    if choice == 0 or not (words or shorts):
        put_number(random, body, random.choice(numbers), order)
    elif choice == 1:
        at = random.choice((4, 8) if it.kind in (0x15, 0x16) else (0, 4))
        body[at : at + 4] = random.choice(ENTITIES)
    elif words and choice == 2:
        at = random.choice(words)
        put(random, body, at % len(body) if body else 0, order, "I", WORDS)
    elif shorts:
        put(random, body, random.choice(shorts), order, "H", SHORTS)


def mutate(random, datagram):
    parts = split(datagram)
    for _ in range(random.choice((1, 1, 1, 2, 2, 3))):
        if not parts:
            break
        it = random.choice(parts)
        action = random.randrange(14)
        if action < 4:
            mutate_fields(random, it)
        elif action < 8:
            data = [p for p in parts if p.kind in (0x15, 0x16)]
            mutate_parameters(random, random.choice(data) if data else it)
        elif action == 8 and it.body:
            at = random.randrange(len(it.body))
            it.body[at] = random.choice((0, 1, 0x7F, 0x80, 0xFF, random.randrange(256)))
        elif action == 9:
            it.flags ^= 1 << random.randrange(8)
        elif action == 10:
            it.kind = random.choice(KINDS)
        elif action == 11:
            it.length = random.choice(SHORTS + [len(it.body) + d for d in (-4, -1, 1, 4)])
        elif action == 12:
            parts.insert(random.randrange(len(parts) + 1), random.choice(parts))
        else:
            del it.body[random.randrange(len(it.body) + 1) :]
    return datagram[:20] + b"".join(p.pack() for p in parts)


# --- processes -----------------------------------------------------------------------------------


def own_domain():
    """Reserves a domain like own_domain.h. Also returns the socket that holds the reservation."""
    for i in range(140):
        domain = 50 + (os.getpid() + i) % 140
        held = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        try:
            held.bind("\0linegate-test-domain-%d" % domain)
            return domain, held
        except OSError:
            held.close()
    complain("no free DDS domain")


class Peer:
    def __init__(self, program, role, domain, *profiles):
        self.role, self.lines, self.dropped = role, collections.Counter(), collections.Counter()
        self.process = subprocess.Popen([program, role, str(domain), *profiles], env=ENVIRONMENT, stdin=subprocess.PIPE,
                                        stdout=subprocess.PIPE)
        self.thread = threading.Thread(target=self.read, daemon=True)
        self.thread.start()

    def read(self):
        for line in self.process.stdout:
            words = line.decode(errors="replace").split()
            if words[:1] == ["guard"]:
                self.dropped[words[1]] = int(words[2])
            elif words:
                self.lines[words[0]] += 1

    def wait_for(self, word, seconds):
        end = time.monotonic() + seconds
        while not self.lines[word] and time.monotonic() < end and self.alive():
            time.sleep(0.02)
        return self.lines[word] > 0

    def alive(self):
        return self.process.poll() is None

    def kilobytes(self):
        with open("/proc/%d/status" % self.process.pid) as status:
            return next((int(line.split()[1]) for line in status if line.startswith("VmRSS")), 0)

    def end(self):
        self.process.stdin.close()
        try:
            return self.process.wait(ENDS_WITHIN) == 0
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
            return False


def find_prefixes(domain, seconds=30):
    """Returns the GUID prefixes of the gateway and of the client, from their announcements to the multicast group."""
    heard = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    heard.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    heard.bind(("239.255.0.1", 7400 + 250 * domain))
    heard.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP,
                     socket.inet_aton("239.255.0.1") + socket.inet_aton("127.0.0.1"))
    heard.settimeout(1)
    gateway = client = None
    end = time.monotonic() + seconds
    while not (gateway and client) and time.monotonic() < end:
        try:
            datagram = heard.recv(65536)
        except socket.timeout:
            continue
        if b"linegate client" in datagram:
            client = datagram[8:20]
        elif b"linegate " in datagram:
            gateway = datagram[8:20]
    heard.close()
    return gateway, client


# --- the run -------------------------------------------------------------------------------------


class Run:
    def __init__(self, options):
        self.options, self.random = options, random.Random(options.seed)
        self.domain, self.held = own_domain()
        with open(os.path.join(HERE, "traffic.hex")) as traffic:
            self.seeds = [bytes.fromhex(line) for line in traffic]
        self.kinds, self.parameters, self.sent = collections.Counter(), collections.Counter(), 0
        self.last = collections.deque(maxlen=5000)

    def start(self):
        role = "gateway" if self.options.mode == "guarded" else "unguarded"
        self.gateway = Peer(self.options.peer, role, self.domain)
        if not self.gateway.wait_for("ready", FOUND_WITHIN):
            complain("the gateway does not start")
        self.client = Peer(self.options.peer, "subscriber", self.domain)
        gateway, client = find_prefixes(self.domain)
        if not gateway or not client or not self.client.wait_for("line", FOUND_WITHIN):
            complain("gateway and client do not find each other")
        # The gateway started first, so its ports are those of participant 0.
        self.ways = [(gateway, client, (10, 11)), (client, gateway, (12, 13))]
        self.seeds = [seed.replace(GATEWAY, gateway).replace(CLIENT, client) for seed in self.seeds]
        self.before = [peer.kilobytes() for peer in (self.gateway, self.client)]

    def send(self, out):
        seed = self.random.choice(self.seeds)
        datagram = mutate(self.random, seed)[:65000]
        for it in split(datagram):
            self.kinds[it.kind] += 1
            if it.kind in (0x15, 0x16):
                for _, pid, _ in parameters_of(it.body, it.order()):
                    self.parameters[pid] += 1
        self.last.append(datagram)
        for _, _, offsets in self.ways:
            for offset in offsets:
                out.sendto(datagram, ("127.0.0.1", 7400 + 250 * self.domain + offset))
        self.sent += 1

    def attack(self):
        out = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        end = time.monotonic() + self.options.seconds
        while time.monotonic() < end and self.gateway.alive() and self.client.alive():
            for _ in range(20):
                self.send(out)
            time.sleep(0.002)  # sockets hold a bounded number of datagrams

    def findings(self):
        found = []
        for peer, before, name in ((self.gateway, self.before[0], "gateway"), (self.client, self.before[1], "client")):
            if not peer.alive():
                found.append("the %s ended with %d" % (name, peer.process.returncode))
            elif peer.kilobytes() - before > GROWTH_KB:
                found.append("the %s grew from %d to %d kB" % (name, before, peer.kilobytes()))
        if not found:
            late = Peer(self.options.peer, "subscriber", self.domain)
            if not late.wait_for("line", FOUND_WITHIN):
                found.append("a new client does not find the gateway")
            late.end()
        for peer, name in ((self.client, "client"), (self.gateway, "gateway")):
            if peer.alive() and not peer.end():
                found.append("the %s does not end" % name)
        return found

    def report(self):
        print("seed %d: %d mutated datagrams, each to 4 ports" % (self.options.seed, self.sent))
        print("submessages sent: " + ", ".join("%02Xh %d" % item for item in sorted(self.kinds.items()) if item[0] in KINDS))
        known = [pid for pid in self.parameters if pid in PARAMETERS]
        print("parameters sent: %d of %d kinds, others %d" % (len(known), len(PARAMETERS), len(self.parameters) - len(known)))
        for peer, name in ((self.gateway, "gateway"), (self.client, "client")):
            dropped = sum(peer.dropped.values())
            print("%s dropped at most %d of %d: %s" % (name, dropped, 2 * self.sent, ", ".join(
                "%s %d" % item for item in peer.dropped.most_common())))
        if self.options.mode == "guarded" and sum(self.gateway.dropped.values()) > 1.9 * self.sent:
            complain("nearly everything was dropped: this tests the guard alone")

    def save(self):
        with open(self.options.save, "w") as out:
            for datagram in self.last:
                out.write(datagram.hex() + "\n")
        print("the last %d datagrams are in %s" % (len(self.last), self.options.save))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("peer", help="the program dds_peer")
    parser.add_argument("--mode", choices=["guarded", "unguarded"], default="guarded")
    parser.add_argument("--seconds", type=float, default=20)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--save", help="file for the last datagrams if something was found")
    run = Run(parser.parse_args())
    run.start()
    run.attack()
    found = run.findings()
    run.report()
    for text in found:
        print("found: " + text)
    if found and run.options.save:
        run.save()
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
