#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Writes the named inputs of the target `observer`, or with `fd` of `observer_fd`: the frames of a master and its
devices.

observer_seeds.py FOLDER [fd]
"""

import pathlib
import struct
import sys

FRAME, STRANGE, WRITE, READ, CHANNEL, PASS, SLEEP, SNAPSHOT, EVENTS, BUS, COMMAND, OUTPUTS, STOP = range(13)


def frame(identifier, *data):
    return struct.pack("<BHB", FRAME, identifier, len(data)) + bytes(data)


def strange(identifier, flags, *data):
    return struct.pack("<BIBB", STRANGE, identifier, flags, len(data)) + bytes(data)


def access(step, node, index, sub, size, value):
    return struct.pack("<BBHBBI", step, node, index, sub, size - 1, value)


def write(node, index, sub, size, value):
    return access(WRITE, node, index, sub, size, value)


def command(kind, node):
    """All other fields are 0 except the code: the number of seconds for COMMAND_CAN_LISTEN."""
    return struct.pack("<BBBHBBHIBBBB", COMMAND, kind, node, 0, 0, 0, 9, 0, 0, 0, 0, 0)


def channel(request, response, said, answered):
    return struct.pack("<BHH", CHANNEL, request, response) + bytes(said) + bytes(answered)


def steps(step, *values):
    return bytes([step, *values])


LOOK = steps(SNAPSHOT, 0, 0) + steps(SNAPSHOT, 1, 1) + steps(EVENTS, 64)


def remap(node, number, cob_id, *objects):
    """Writes TPDO `number` of the node in the order that CiA 301 requires."""
    record, mapping = 0x1800 + number - 1, 0x1A00 + number - 1
    out = write(node, record, 1, 4, 0x80000000 | cob_id) + write(node, mapping, 0, 1, 0)
    for place, value in enumerate(objects, 1):
        out += write(node, mapping, place, 4, value)
    return out + write(node, mapping, 0, 1, len(objects)) + write(node, record, 1, 4, cob_id)


SEEDS = {
    "boot": frame(0x705, 0)
    + write(5, 0x1017, 0, 2, 100)
    + access(READ, 5, 0x1018, 1, 4, 0x1234)
    + frame(0x000, 1, 0)
    + frame(0x705, 5)
    + frame(0x185, 1, 2, 3, 4, 5, 6)
    + frame(0x205, 6, 0)
    + LOOK
    + steps(PASS, 200),
    "remap": remap(5, 1, 0x185, 0x60640020, 0x60410010)
    + frame(0x000, 1, 5)
    + frame(0x185, 1, 2, 3, 4, 5, 6)
    + LOOK
    + remap(6, 1, 0x1C6, 0x60000108)
    + steps(SLEEP, 20)
    + steps(PASS, 1)
    + frame(0x1C6, 7)
    + LOOK,
    "conflict": remap(5, 1, 0x186, 0x60410010) + steps(PASS, 250) * 5 + LOOK,
    "unknown-pdos": frame(0x485, 1, 2, 3) * 3 + steps(PASS, 1) + LOOK + frame(0x485, 1, 2, 3, 4) + LOOK,
    "further-channel": write(5, 0x1201, 1, 4, 0x6E5)
    + write(5, 0x1201, 2, 4, 0x5E5)
    + channel(0x6E5, 0x5E5, [0x40, 0x18, 0x10, 4, 0, 0, 0, 0], [0x43, 0x18, 0x10, 4, 77, 0, 0, 0])
    + channel(0x6E5, 0x5E5, [0x2B, 1, 0x12, 1, 0, 0, 0, 0x80], [0x60, 1, 0x12, 1, 0, 0, 0, 0])
    + LOOK,
    "segments": channel(0x605, 0x585, [0x40, 8, 0x10, 0, 0, 0, 0, 0], [0x41, 8, 0x10, 0, 9, 0, 0, 0])
    + channel(0x605, 0x585, [0x60] + [0] * 7, [0x00] + [65] * 7)
    + channel(0x605, 0x585, [0x70] + [0] * 7, [0x1B] + [66] * 7)
    + LOOK,
    "block": channel(0x605, 0x585, [0xC2, 0, 0x20, 1, 9, 0, 0, 0], [0xA0, 0, 0x20, 1, 4, 0, 0, 0])
    + frame(0x605, 1, 1, 2, 3, 4, 5, 6, 7)
    + channel(0x605, 0x585, [0x82, 8, 9, 0, 0, 0, 0, 0], [0xA2, 2, 4, 0, 0, 0, 0, 0])
    + channel(0x605, 0x585, [0xD5, 0, 0, 0, 0, 0, 0, 0], [0xA1] + [0] * 7)
    + LOOK,
    "emcy-and-guarding": frame(0x085, 0x30, 0x81, 0x11, 0, 0, 0, 0, 0)
    + write(5, 0x1014, 0, 4, 0x99)
    + frame(0x099, 0, 0, 0, 0, 0, 0, 0, 0)
    + strange(0x705, 2)
    + frame(0x705, 0x85)
    + LOOK,
    "sync-time-strange": frame(0x080) + frame(0x100, 1, 2, 3, 4, 5, 6) + strange(0x1ABCDEF0, 1, 1, 2)
    + strange(0x185, 0x0C, *range(12)) + LOOK,
    "bus": frame(0x185, 1, 2, 3, 4, 5, 6) + steps(BUS, 2, 4, 0) + LOOK + steps(BUS, 2, 1, 0) + steps(BUS, 4, 0, 9) + LOOK,
    "asked-to-send": b"".join(command(kind, 5) for kind in range(26))
    + strange(0x1ABCDEF0, 1, 1, 2)
    + steps(OUTPUTS, 0, 0)
    + steps(STOP)
    + LOOK,
}


def usdo(step, node, index, sub, data, session=1, master=127):
    """A complete expedited transfer of a master, by USDO."""
    return struct.pack("<BBHBB", step, node, index, sub, len(data)) + bytes(data) + bytes([session, master])


def remap_fd(node, number, cob_id, *objects):
    record, mapping = 0x1800 + number - 1, 0x1A00 + number - 1
    out = usdo(WRITE, node, record, 1, struct.pack("<I", 0x80000000 | cob_id)) + usdo(WRITE, node, mapping, 0, [0])
    for place, value in enumerate(objects, 1):
        out += usdo(WRITE, node, mapping, place, struct.pack("<I", value))
    return out + usdo(WRITE, node, mapping, 0, [len(objects)]) + usdo(WRITE, node, record, 1, struct.pack("<I", cob_id))


FD_SEEDS = {
    "boot": frame(0x705, 0)
    + usdo(WRITE, 5, 0x1017, 0, [100, 0])
    + usdo(READ, 5, 0x1018, 1, [0x34, 0x12, 0, 0])
    + frame(0x000, 1, 0)
    + frame(0x705, 5)
    + frame(0x185, *range(64))
    + frame(0x205, *range(64))
    + LOOK
    + steps(PASS, 200),
    "remap": remap_fd(5, 1, 0x185, 0x60000108, 0x60000208)
    + frame(0x000, 1, 5)
    + frame(0x185, *range(64))
    + LOOK
    + remap_fd(6, 1, 0x1C6, 0x60000108)
    + steps(PASS, 1)
    + frame(0x1C6, 7)
    + LOOK,
    # A download in segments: initiate, two segments, the end; and an upload that the server aborts.
    "segments": channel(0x601, 0x585, [5, 0x02, 1, 0, 0x50, 0x1F, 0x0F, 0], [1, 0x22, 1, 0, 0x50, 0x1F, 0, 0])
    + frame(0x601, 5, 0x03, 1, 0, *[7] * 60)
    + frame(0x585, 1, 0x23, 1, 0)
    + frame(0x601, 5, 0x04, 1, 9, *[8] * 9)
    + frame(0x585, 1, 0x24, 1)
    + channel(0x601, 0x585, [5, 0x11, 2, 0, 0x08, 0x10, 0, 0], [1, 0x7F, 2, 0, 0x08, 0x10, 0x33, 0])
    + LOOK,
    "emcy": frame(0x085, 0x30, 0x81, 0x11, *[0] * 17)
    + usdo(WRITE, 5, 0x1014, 0, [0x99, 0, 0, 0])
    + frame(0x099, *[0] * 20)
    + LOOK,
    "asked-to-send": b"".join(command(kind, 5) for kind in range(26)) + steps(OUTPUTS, 0, 0) + steps(STOP) + LOOK,
}


def main():
    folder = pathlib.Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    for name, content in (FD_SEEDS if sys.argv[2:] == ["fd"] else SEEDS).items():
        (folder / name).write_bytes(content)


if __name__ == "__main__":
    main()
