# SPDX-License-Identifier: Apache-2.0
"""Checks recorded frames with tshark's CANopen dissector."""

import os
import re
import struct

from actors import FOLDER, Failed, check, run

LINKTYPE_CAN_SOCKETCAN = 227
SHORT_EMCY = (0.0, 0x085, bytes.fromhex("00630104000000"))  # seven bytes
WRONG = re.compile(r"Malformed|Unknown")


def write_pcap(path, frames):
    """Writes [(seconds, identifier, data)] as a capture file."""
    with open(path, "wb") as file:
        file.write(struct.pack("<IHHiIII", 0xA1B2C3D4, 2, 4, 0, 0, 0x40000, LINKTYPE_CAN_SOCKETCAN))
        for seconds, identifier, data in frames:
            packet = struct.pack(">IB3x", identifier, len(data)) + data
            file.write(struct.pack("<IIII", int(seconds), int(seconds % 1 * 1e6), len(packet), len(packet)))
            file.write(packet)


def nothing_is_malformed(frames):
    """Checks all frames that a witness recorded."""
    wrong = malformed_frames(frames)
    check(f"tshark finds nothing malformed in {len(frames)} frames: {wrong[:5]}", wrong == [])


def malformed_frames(frames):
    """Returns the frames that tshark calls malformed, or whose service it does not know, with its comment. One
    malformed frame is appended to them, to prove that the dissector is active."""
    path = os.path.join(FOLDER, "frames.pcap")
    write_pcap(path, [*frames, SHORT_EMCY])
    status, text = run("tshark", "-r", path, "-d", "can.subdissector,canopen", "-T", "fields", "-e", "_ws.col.Info",
                       within=60)  # fmt: skip
    said = [line for line in text.splitlines() if not line.startswith("Running as user")]
    if status != 0 or len(said) != len(frames) + 1 or not WRONG.search(said[-1]):
        raise Failed(f"tshark ended with {status}: {text[-500:]}")
    return [(f"{frame[1]:X}#{frame[2].hex()}", info) for frame, info in zip(frames, said) if WRONG.search(info)]
