#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""node_seeds.py FOLDER   Writes the inputs of the target `node` that are kept in corpus/node: one for each service,
as steps of node.cpp."""

import os
import struct
import sys

(FRAME, STRANGE, REMOTE, DOWNLOAD, PASS, SEND, CLIENT, TRIGGER, ERROR, BUS, HOLD, REFUSE, POWER_ON) = range(13)
IDS = [0x000, 0x080, 0x081, 0x085, 0x087, 0x100, 0x185, 0x187, 0x201, 0x205, 0x285, 0x301,
       0x305, 0x401, 0x501, 0x583, 0x587, 0x605, 0x607, 0x6C0, 0x705, 0x707, 0x708, 0x77F]  # fmt: skip
START, STOP, PRE_OPERATIONAL, RESET_NODE = 0x01, 0x02, 0x80, 0x81


def frame(identifier, text=""):
    data = bytes.fromhex(text)
    return bytes([FRAME, IDS.index(identifier), len(data)]) + data


def remote(identifier):
    return bytes([REMOTE, IDS.index(identifier)])


def download(index, sub, size, value):
    return struct.pack("<BHBB", DOWNLOAD, index, sub, size - 1) + value.to_bytes(size, "little")


def wait(milliseconds):
    return bytes([PASS, milliseconds, SEND, 255])


def nmt(command):
    return frame(0x000, f"{command:02X}05")


def client(which, index, sub, size):
    return struct.pack("<BBHBB", CLIENT, which, index, sub, size)


SEEDS = {
    "nmt": nmt(START) + wait(5) + nmt(STOP) + nmt(PRE_OPERATIONAL) + frame(0x000, "01") + nmt(RESET_NODE) + wait(5)
    + bytes([REFUSE, 0]) + nmt(START) + bytes([REFUSE, 1]) + nmt(START) + bytes([POWER_ON]),
    "sync": nmt(START) + download(0x1019, 0, 1, 10) + frame(0x080, "01") + frame(0x080, "0B") + frame(0x080, "0102")
    + download(0x1007, 0, 4, 500) + download(0x1006, 0, 4, 2000) + frame(0x305, "3412") + frame(0x080, "02") + wait(20),
    "sync-producer": download(0x1006, 0, 4, 1000) + download(0x1005, 0, 4, 0x40000080) + nmt(START) + wait(10),
    "time": frame(0x100, "001234050A00") + frame(0x100, "FFFFFF0F0100") + frame(0x100, "00"),
    "heartbeat": frame(0x707, "00") + frame(0x707, "05") + wait(50) + frame(0x707, "7F") + wait(200) + frame(0x707, "05")
    + frame(0x707, "0505") + download(0x1017, 0, 2, 20) + wait(100) + frame(0x705, "00") + frame(0x705, "05"),
    "guarding": remote(0x705) + wait(50) + remote(0x705) + wait(255) + wait(255) + remote(0x705) + wait(5),
    "emcy": frame(0x087, "1023018100000000") + frame(0x087, "10") + bytes([ERROR, 0x10, 0x23, 1, 1, 2, 3]) + wait(5)
    + bytes([ERROR, 0x10, 0x23, 0]) + wait(5) + download(0x1003, 0, 1, 0) + download(0x1015, 0, 2, 100)
    + bytes([BUS, 0, 3, 0, BUS, 0, 5, 1]) + download(0x1028, 2, 4, 0x88) + download(0x1029, 1, 1, 2) + wait(20),
    "rpdo": nmt(START) + frame(0x205, "341256") + frame(0x205, "34") + frame(0x205, "3412567890") + frame(0x305, "7856")
    + frame(0x080) + download(0x1400, 5, 2, 20) + frame(0x205, "010203") + wait(60) + frame(0x205, "010203"),
    "tpdo": nmt(START) + wait(5) + bytes([TRIGGER, 4, 1, 0x34, 0x12]) + wait(5) + frame(0x080) + remote(0x185)
    + bytes([HOLD, 1, TRIGGER, 4, 1, 5, 0, TRIGGER, 0, 1, HOLD, 0]) + wait(5) + bytes([TRIGGER, 1, 1]) + wait(5),
    "remapping": download(0x1800, 1, 4, 0x80000185) + download(0x1A00, 0, 1, 0) + download(0x1A00, 1, 4, 0x20010310)
    + download(0x1A00, 0, 1, 1) + download(0x1800, 2, 1, 252) + download(0x1800, 1, 4, 0x00000185) + nmt(START)
    + frame(0x080) + remote(0x185) + wait(5),
    "mpdo": nmt(START) + frame(0x401, "850020013412FFFF") + frame(0x401, "8500300100000000") + frame(0x401, "0700")
    + frame(0x501, "0700300155AA0000") + frame(0x501, "8700300155AA0000") + bytes([TRIGGER, 2, 4, TRIGGER, 3, 1])
    + wait(5) + bytes([TRIGGER, 4, 2, 1, 0]) + wait(5),
    "sdo-servers": frame(0x6C0, "4018100100000000") + download(0x1202, 1, 4, 0x6C1) + download(0x1202, 2, 4, 0x4C1)
    + struct.pack("<BIBB", STRANGE, 0x6C1, 0, 8) + bytes.fromhex("4000100000000000") + frame(0x605, "4000") + wait(5),
    "sdo-blocks": frame(0x605, "C6042000100000") + frame(0x605, "C604200010000000") + frame(0x605, "0161616161616161")
    + frame(0x605, "0261616161616161") + frame(0x605, "8361610000000000") + frame(0x605, "D500000000000000")
    + frame(0x605, "A404200004000000") + frame(0x605, "A300000000000000") + wait(5) + frame(0x605, "A203040000000000")
    + frame(0x605, "A100000000000000"),
    "sdo-clients": client(0, 0x1018, 1, 0) + wait(2) + frame(0x583, "4318100147000000") + client(0, 0x2000, 0, 9)
    + wait(2) + frame(0x583, "6000200000000000") + frame(0x583, "20") + frame(0x583, "2000000000000000") + wait(2)
    + frame(0x583, "3000000000000000") + client(1, 0x1008, 0, 0) + frame(0x587, "8008100000000206") + wait(5)
    + client(1, 0x2000, 0, 200) + wait(255),
    "storage": download(0x1017, 0, 2, 50) + download(0x1010, 1, 4, 0x65766173) + bytes([POWER_ON]) + wait(60)
    + download(0x1020, 1, 4, 15000) + download(0x1020, 2, 4, 1) + download(0x1010, 2, 4, 0x65766173)
    + download(0x1011, 1, 4, 0x64616F6C) + nmt(RESET_NODE) + download(0x1010, 1, 4, 1) + wait(5),
    "29-bits": download(0x1014, 0, 4, 0x80000085) + download(0x1014, 0, 4, 0x20012345) + bytes([ERROR, 0, 0x10, 1])
    + download(0x1005, 0, 4, 0x20000080) + struct.pack("<BIBB", STRANGE, 0x80, 1, 0) + nmt(START)
    + struct.pack("<BIBB", STRANGE, 0x01234567, 3, 0) + wait(5),
}  # fmt: skip


if __name__ == "__main__":
    os.makedirs(sys.argv[1], exist_ok=True)
    for name, content in SEEDS.items():
        with open(os.path.join(sys.argv[1], name), "wb") as seed:
            seed.write(content)
