#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""peer_seeds.py FOLDER   Writes the inputs of the target `peers` that are kept in corpus/peers, as steps of peers.cpp: messages
of every kind, requests with every end, EMCYs and a flood of them."""

import os
import struct
import sys

(RAW, SAMPLE, ANSWER, REQUEST, CANCEL, LINES, TIME, END) = range(8)
(READY, STATE, GONE, REPLY, EVENT, EXPIRY) = range(1, 7)  # FromPeers
(PRESS, STORE, OTHER, UNNAMED) = range(4)  # kPeerLines
NAMES = [(b"hall-b", b"press"), (b"hall-b", b"store"), (b"hall-c", b"press"), (b"", b"press")]
TO_END = 60_000  # ms, longer than any time-out


def raw(kind, content=b""):
    message = bytes([kind]) + content
    return struct.pack("<BH", RAW, len(message)) + message


def name(line):
    return b"".join(struct.pack("<H", len(text)) + text for text in NAMES[line])


def state(line, incarnation, time, network=7):
    """Of a host. Times have their highest octet first."""
    return struct.pack("<BBBB", SAMPLE, 0, line, incarnation) + struct.pack(">q", time) + struct.pack("<H", network)


def gone(line):
    return struct.pack("<BBBB", SAMPLE, 1, line, 0)


def event(line, incarnation, number, time, emcy=None, times=1):
    """emcy: (sender, network, node, code)"""
    kind = 2 if times == 1 else 2 + 4
    out = struct.pack("<BBBBBH", SAMPLE, kind, line, incarnation, 70, number) + struct.pack(">q", time)
    sender, network, node, code = emcy or (0, 0, 0, 0)
    out += struct.pack("<BBB", sender, network != 0, emcy is not None)
    if emcy is not None:
        out += struct.pack("<HBHBBB", code, 0x11, network, node, 1, 3)
    return out + (b"" if times == 1 else bytes([times]))


def request(line, timeout=3_000, write=None):
    data = b"" if write is None else bytes([len(write)]) + write
    return struct.pack("<BBHHBBHBB", REQUEST, line, timeout, 7, 5, 1, 0x6200, 1, write is not None) + data


def answer(which=0, domain=0, code=0, data=b""):
    return struct.pack("<BBBHH", ANSWER, which, domain, code, len(data)) + data


def wait(milliseconds):
    return struct.pack("<BH", TIME, milliseconds)


def alive(line, seconds, incarnation=7):
    return b"".join(state(line, incarnation, at * 10**9) + wait(1_000) for at in range(1, seconds + 1))


NOW = 10**9
SEEDS = {
    "requests": alive(PRESS, 1) + request(PRESS) + answer(data=b"\1") + request(PRESS, write=b"\7") + answer()
    + request(PRESS) + answer(domain=1, code=0x21) + request(PRESS) + answer(domain=2, code=3)
    + request(PRESS) + answer(domain=77) + request(PRESS, write=b"\7" * 9) + bytes([CANCEL, 6]) + answer(),
    "without-an-answer": alive(PRESS, 1) + request(PRESS) + request(PRESS, write=b"1234") + bytes([END])
    + alive(PRESS, 2) + request(PRESS, 100) + wait(200) + answer() + request(PRESS) + wait(TO_END),
    "absent": request(PRESS) + alive(PRESS, 1) + gone(PRESS) + request(PRESS) + alive(PRESS, 1) + state(PRESS, 8, NOW)
    + wait(100) + state(PRESS, 7, NOW + 5) + request(PRESS) + wait(4_000) + request(PRESS),
    "lines": alive(PRESS, 1) + request(PRESS) + bytes([LINES, 4]) + answer() + alive(OTHER, 1) + request(OTHER)
    + bytes([LINES, 0]) + wait(TO_END) + bytes([LINES, 7]) + alive(STORE, 2),
    "emcys": alive(PRESS, 2) + event(PRESS, 7, 10, 3 * NOW, (5, 0, 5, 0x8130)) + wait(100)
    + event(PRESS, 7, 11, 3 * NOW, (9, 0, 9, 0x8130)) + event(PRESS, 7, 12, 3 * NOW, (9, 12, 3, 0x8130)) + wait(100)
    + event(PRESS, 7, 13, 3 * NOW) + event(PRESS, 7, 20, 3 * NOW, (5, 0, 5, 0)) + wait(100)
    + event(PRESS, 7, 21, 0, (5, 0, 5, 1)) + event(PRESS, 7, 22, 2**62, (5, 0, 5, 1)) + wait(5_000),
    "emcys-flood": alive(PRESS, 2) + b"".join(
        event(PRESS, 7, 1 + 256 * i, 2 * NOW, (5, 0, 5, 0x8130), 255) + event(PRESS, 7, 256 + 256 * i, 2 * NOW, (6, 0, 6, 0x8131))
        + wait(60) for i in range(8)),
    "emcys-early": event(PRESS, 9, 1, NOW, (5, 0, 5, 1)) + alive(PRESS, 1, 9) + event(PRESS, 8, 2, NOW, (5, 0, 5, 2), 200)
    + wait(3_000) + state(PRESS, 8, NOW) + event(PRESS, 8, 65_000, NOW, (5, 0, 5, 2)),
    "nonsense-of-hosts": state(UNNAMED, 7, NOW) + gone(UNNAMED) + event(UNNAMED, 7, 1, NOW, (5, 0, 5, 1)) + state(PRESS, 0, -1)
    + event(PRESS, 0, 0, -1, (0, 7, 0, 1)) + event(PRESS, 7, 1, 0, (5, 0, 200, 1)) + answer(200, 9, 9, b"1") + wait(1_000),
    "messages": wait(0) + raw(READY) + raw(STATE, name(PRESS) + struct.pack("<QqH", 7, NOW, 7)) + request(PRESS)
    + raw(REPLY, struct.pack("<QBII", 1, 0, 0, 2) + b"12") + request(PRESS, write=b"1")
    + raw(REPLY, struct.pack("<QBII", 2, 1, 0x06020000, 0)) + raw(EXPIRY, struct.pack("<q", NOW))
    + raw(EVENT, name(PRESS) + struct.pack("<QQQqBBBHBHBBB", 7, 70, 1, NOW, 5, 0, 1, 0x8130, 0x11, 0, 5, 1, 3)) + wait(100)
    + raw(GONE, name(PRESS)) + raw(GONE, name(PRESS)),
    "message-before-the-settings": bytes([END]) + raw(READY),
    "message-of-no-kind": wait(0) + raw(99),
    "message-cut": wait(0) + raw(STATE, name(PRESS)),
    "message-with-more": wait(0) + raw(READY, b"1"),
    "answer-to-no-request": wait(0) + raw(REPLY, struct.pack("<QBII", 1, 0, 0, 0)),
    "answer-of-any-length": wait(0) + raw(REPLY, struct.pack("<QBII", 1, 0, 0, 2**32 - 1)),
    "state-of-a-line-without-a-name": wait(0) + raw(STATE, name(UNNAMED) + struct.pack("<QqH", 7, NOW, 7)),
}  # fmt: skip


if __name__ == "__main__":
    os.makedirs(sys.argv[1], exist_ok=True)
    for file, content in SEEDS.items():
        with open(os.path.join(sys.argv[1], file), "wb") as seed:
            seed.write(content)
