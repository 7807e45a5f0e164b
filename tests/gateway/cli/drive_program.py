# SPDX-License-Identifier: Apache-2.0
"""Programs (1F50h) for the simulated drive: a header with identification and CRC, and content."""

import struct


def crc(data):
    """CRC-16, polynomial 1021h, from 0."""
    value = 0
    for octet in data:
        value ^= octet << 8
        for _ in range(8):
            value = (value << 1 ^ 0x1021) & 0xFFFF if value & 0x8000 else value << 1
    return value


def program(identification, size):
    """size: number of octets of its content."""
    content = bytes(i * 7 & 0xFF for i in range(size))
    return b"LGFW" + struct.pack("<IH", identification, crc(content)) + content
