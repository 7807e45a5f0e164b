# SPDX-License-Identifier: Apache-2.0
"""SDO written from CiA 301 alone, for the foreign device in Python: it shares no code and no design with Linegate.
Frames are the 8 bytes of their data."""

import binascii
import struct

ABORT, TOGGLE = 0x80, 0x10
NO_OBJECT, READ_ONLY, SPECIFIER, CHECK_SUM = 0x06020000, 0x06010002, 0x05040001, 0x05040004
BLOCK_SIZE = 20


def mux(index, sub):
    return struct.pack("<HB", index, sub)


def aborted(place, code):
    return bytes([ABORT]) + place + struct.pack("<I", code)


def filled(frame):
    return bytes(frame).ljust(8, b"\0")


def check_sum(data):
    return struct.pack("<H", binascii.crc_hqx(data, 0))


def segments(data, start, count):
    """Returns the segments of a sub-block, from byte `start` on."""
    out = []
    for number in range(1, count + 1):
        part = data[start : start + 7]
        start += 7
        last = start >= len(data)
        out.append(filled(bytes([number | (0x80 if last else 0)]) + part))
        if last:
            break
    return out


class SdoServer:
    """objects: {(index, sub): bytes}; writable: the keys that may be written."""

    def __init__(self, objects, writable):
        self.objects = objects
        self.writable = writable
        self.state = None
        self.seen = set()  # kinds of transfers so far

    def take(self, frame):
        """Returns the frames that answer it."""
        if self.state == "block segments":
            return self.block_segment(frame)
        specifier = frame[0] >> 5
        if frame[0] == ABORT:
            self.state = None
            return []
        if specifier == 5:
            return self.block_upload(frame)
        kinds = {0: self.segment_in, 1: self.download, 2: self.upload, 3: self.segment_out, 6: self.block_download}
        return kinds.get(specifier, self.refuse)(frame)

    def refuse(self, _frame, code=SPECIFIER):
        self.state = None
        return [aborted(self.place if code != SPECIFIER else b"\0\0\0", code)]

    def key(self, frame):
        self.place = frame[1:4]
        return struct.unpack("<HB", self.place)

    def may_write(self, frame):
        key = self.key(frame)
        if key not in self.objects:
            return NO_OBJECT
        return None if key in self.writable else READ_ONLY

    def store(self, data, kind):
        self.objects[struct.unpack("<HB", self.place)] = bytes(data)
        self.seen.add(kind)
        self.state = None

    def download(self, frame):
        code = self.may_write(frame)
        if code:
            return self.refuse(frame, code)
        if frame[0] & 2:
            unused = frame[0] >> 2 & 3 if frame[0] & 1 else 0
            self.store(frame[4 : 8 - unused], "expedited download")
        else:
            self.state, self.data, self.toggle = "segments in", bytearray(), 0
        return [filled(b"\x60" + self.place)]

    def segment_in(self, frame):
        if self.state != "segments in" or frame[0] & TOGGLE != self.toggle:
            return self.refuse(frame)
        self.data += frame[1 : 8 - (frame[0] >> 1 & 7)]
        answer = filled([0x20 | self.toggle])
        self.toggle ^= TOGGLE
        if frame[0] & 1:
            self.store(self.data, "segmented download")
        return [answer]

    def upload(self, frame):
        data = self.objects.get(self.key(frame))
        if data is None:
            return self.refuse(frame, NO_OBJECT)
        if 0 < len(data) <= 4:
            self.seen.add("expedited upload")
            return [filled(bytes([0x43 | (4 - len(data)) << 2]) + self.place + data)]
        self.state, self.data, self.at, self.toggle = "segments out", data, 0, 0
        return [b"\x41" + self.place + struct.pack("<I", len(data))]

    def segment_out(self, frame):
        if self.state != "segments out" or frame[0] & TOGGLE != self.toggle:
            return self.refuse(frame)
        part = self.data[self.at : self.at + 7]
        self.at += 7
        last = self.at >= len(self.data)
        answer = filled(bytes([self.toggle | (7 - len(part)) << 1 | last]) + part)
        self.toggle ^= TOGGLE
        if last:
            self.seen.add("segmented upload")
            self.state = None
        return [answer]

    def block_download(self, frame):
        if frame[0] & 1:
            return self.block_download_end(frame)
        code = self.may_write(frame)
        if code:
            return self.refuse(frame, code)
        self.state, self.data, self.number, self.checked = "block segments", bytearray(), 0, frame[0] & 4
        return [filled(b"\xa4" + self.place + bytes([BLOCK_SIZE]))]

    def block_segment(self, frame):
        if frame[0] == ABORT:
            self.state = None
            return []
        last = False
        if frame[0] & 0x7F == self.number + 1:
            self.number += 1
            self.data += frame[1:]
            last = bool(frame[0] & 0x80)
        if not last and frame[0] & 0x7F < BLOCK_SIZE:
            return []
        answer = filled([0xA2, self.number, BLOCK_SIZE])
        self.number = 0
        if last:
            self.state = "block end"
        return [answer]

    def block_download_end(self, frame):
        if self.state != "block end":
            return self.refuse(frame)
        data = self.data[: len(self.data) - (frame[0] >> 2 & 7)]
        if self.checked and frame[1:3] != check_sum(data):
            return self.refuse(frame, CHECK_SUM)
        self.store(data, "block download")
        return [filled(b"\xa1")]

    def block_upload(self, frame):
        step = frame[0] & 3
        if step == 0:
            data = self.objects.get(self.key(frame))
            if data is None:
                return self.refuse(frame, NO_OBJECT)
            self.state, self.data, self.at, self.size = "block out", data, 0, frame[4]
            return [b"\xc6" + self.place + struct.pack("<I", len(data))]
        if self.state != "block out":
            return self.refuse(frame)
        if step == 1:
            self.seen.add("block upload")
            self.state = None
            return []
        if step == 2:
            self.at += 7 * frame[1]
            self.size = frame[2]
            if self.at >= len(self.data):
                unused = -len(self.data) % 7
                return [filled(bytes([0xC1 | unused << 2]) + check_sum(self.data))]
        return segments(self.data, self.at, self.size)


class SdoClient:
    """ask: sends a frame, unless it is None, and returns the next answer; with `first`, one that is later than the
    frame."""

    def __init__(self, ask):
        self.ask = ask

    def first(self, frame, place):
        """Returns the answer to an initiate request: bytes, or the abort code."""
        answer = self.ask(filled(frame), first=True)
        if answer[1:4] != place:
            raise ValueError(f"an answer to something else: {answer.hex()}")
        return struct.unpack("<I", answer[4:])[0] if answer[0] == ABORT else answer

    def upload(self, index, sub):
        place = mux(index, sub)
        answer = self.first(b"\x40" + place, place)
        if isinstance(answer, int):
            return answer
        if answer[0] & 2:
            return answer[4 : 8 - (answer[0] >> 2 & 3)]
        data, toggle = b"", 0
        while True:
            answer = self.ask(filled([0x60 | toggle]))
            if answer[0] & 0xF0 != toggle:
                raise ValueError(f"not a segment: {answer.hex()}")
            data += answer[1 : 8 - (answer[0] >> 1 & 7)]
            toggle ^= TOGGLE
            if answer[0] & 1:
                return data

    def download(self, index, sub, data):
        """Returns nothing, or the abort code."""
        place = mux(index, sub)
        if len(data) <= 4:
            answer = self.first(bytes([0x23 | (4 - len(data)) << 2]) + place + data, place)
            return answer if isinstance(answer, int) else None
        answer = self.first(b"\x21" + place + struct.pack("<I", len(data)), place)
        if isinstance(answer, int):
            return answer
        toggle = 0
        for start in range(0, len(data), 7):
            part = data[start : start + 7]
            last = start + 7 >= len(data)
            answer = self.ask(filled(bytes([toggle | (7 - len(part)) << 1 | last]) + part))
            if answer[0] == ABORT:
                return struct.unpack("<I", answer[4:])[0]
            if answer[0] != 0x20 | toggle:
                raise ValueError(f"not the answer to a segment: {answer.hex()}")
            toggle ^= TOGGLE
        return None

    def block_upload(self, index, sub, size=BLOCK_SIZE):
        place = mux(index, sub)
        answer = self.first(b"\xa4" + place + bytes([size]), place)
        if isinstance(answer, int):
            return answer
        total = struct.unpack("<I", answer[4:])[0]
        data, last, request = b"", False, b"\xa3"
        while not last:
            for number in range(1, size + 1):
                frame = self.ask(filled(request) if request else None)
                request = None
                if frame[0] & 0x7F != number:
                    raise ValueError(f"not segment {number}: {frame.hex()}")
                data += frame[1:]
                last = bool(frame[0] & 0x80)
                if last:
                    break
            request = bytes([0xA2, number, size])
        end = self.ask(filled(request))
        data = data[: len(data) - (end[0] >> 2 & 7)]
        if end[0] & 0xE3 != 0xC1 or end[1:3] != check_sum(data) or len(data) != total:
            raise ValueError(f"not the end of {total} bytes: {end.hex()}")
        self.ask(b"\xa1" + bytes(7), answered=False)
        return data

    def block_download(self, index, sub, data):
        place = mux(index, sub)
        answer = self.first(b"\xc6" + place + struct.pack("<I", len(data)), place)
        if isinstance(answer, int):
            return answer
        start, size = 0, answer[4]
        while start < len(data):
            sent = segments(data, start, size)
            for frame in sent[:-1]:
                self.ask(frame, answered=False)
            answer = self.ask(sent[-1])
            if answer[0] != 0xA2:
                raise ValueError(f"not the answer to a sub-block: {answer.hex()}")
            start, size = start + 7 * answer[1], answer[2]
        answer = self.ask(filled(bytes([0xC1 | (-len(data) % 7) << 2]) + check_sum(data)))
        return None if answer[0] == 0xA1 else struct.unpack("<I", answer[4:])[0]
