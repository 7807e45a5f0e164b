# SPDX-License-Identifier: Apache-2.0
"""The data types of CiA 301: the bits of values, and what they mean, independent of the product. Device descriptions with
objects of these types: read from EDS files, and made at random."""

import configparser
import struct
from dataclasses import dataclass, field

NANOSECONDS_OF_A_DAY = 86_400_000_000_000
DAYS_FROM_1970_TO_1984 = 5_113

# Code: name and bits; 0: as many as a PDO maps.
TYPES = {
    0x01: ("BOOLEAN", 1), 0x02: ("INTEGER8", 8), 0x03: ("INTEGER16", 16), 0x04: ("INTEGER32", 32),
    0x05: ("UNSIGNED8", 8), 0x06: ("UNSIGNED16", 16), 0x07: ("UNSIGNED32", 32), 0x08: ("REAL32", 32),
    0x09: ("VISIBLE_STRING", 0), 0x0A: ("OCTET_STRING", 0), 0x0B: ("UNICODE_STRING", 0), 0x0C: ("TIME_OF_DAY", 48),
    0x0D: ("TIME_DIFFERENCE", 48), 0x0F: ("DOMAIN", 0), 0x10: ("INTEGER24", 24), 0x11: ("REAL64", 64),
    0x12: ("INTEGER40", 40), 0x13: ("INTEGER48", 48), 0x14: ("INTEGER56", 56), 0x15: ("INTEGER64", 64),
    0x16: ("UNSIGNED24", 24), 0x18: ("UNSIGNED40", 40), 0x19: ("UNSIGNED48", 48), 0x1A: ("UNSIGNED56", 56),
    0x1B: ("UNSIGNED64", 64),
}


@dataclass(frozen=True)
class Entry:
    """An object in a PDO."""
    index: int
    name: str
    type: str
    bits: int

    def meaning(self, raw):
        """The value of these bits, as the Python module has it."""
        octets = raw.to_bytes((self.bits + 7) // 8, "little")
        if self.type == "BOOLEAN":
            return raw != 0
        if self.type.startswith("INTEGER"):
            return raw - (1 << self.bits) if raw >> (self.bits - 1) else raw
        if self.type.startswith("UNSIGNED"):
            return raw
        if self.type.startswith("REAL"):
            return struct.unpack("<f" if self.bits == 32 else "<d", octets)[0]
        if self.type.startswith("TIME"):
            days = (raw >> 32) + (DAYS_FROM_1970_TO_1984 if self.type == "TIME_OF_DAY" else 0)
            return days * NANOSECONDS_OF_A_DAY + (raw & 0xFFF_FFFF) * 1_000_000
        if self.type == "VISIBLE_STRING":
            return octets.split(b"\0")[0].decode("latin-1")
        if self.type == "UNICODE_STRING":
            return text_of([octets[i] | octets[i + 1] << 8 for i in range(0, len(octets), 2)])
        return octets

    def values(self, writable):
        """Bits of the values at all limits. writable: only those that follow from their meaning."""
        most = (1 << self.bits) - 1
        if self.type in ("BOOLEAN", "OCTET_STRING", "DOMAIN") or self.type.startswith(("INTEGER", "UNSIGNED")):
            return [0, most, most >> 1, most ^ most >> 1, 0xA55A_1234_5678_9AF0 & most, 1]
        if self.type == "REAL32":
            more = [] if writable else [0xFFC0_0001, 0x7FFF_FFFF]  # further bits that are no number
            return [0, 0x8000_0000, 0x7F7F_FFFF, 0xFF7F_FFFF, 1, 0x7F80_0000, 0xFF80_0000, 0x7FC0_0000, 0xBFC0_0000] + more
        if self.type == "REAL64":
            more = [] if writable else [most, 0x7FF0_0000_0000_0001]
            return [0, 1 << 63, 0x7FEF_FFFF_FFFF_FFFF, 0xFFEF_FFFF_FFFF_FFFF, 1, 0x7FF0_0000_0000_0000,
                    0xFFF0_0000_0000_0000, 0x7FF8_0000_0000_0000, 0xBFB9_9999_9999_999A] + more
        if self.type.startswith("TIME"):
            # The bits of ms have room for more than a day, and four bits are reserved.
            return [0, 86_399_999 | 0xFFFF << 32, 86_399_999, 1 << 32] + ([] if writable else [most])
        units = 16 if self.type == "UNICODE_STRING" else 8
        out = [0]
        for text in ("A", "Ünïcödé+", "~" * 8, "\x01\x7f\x80\xff") + (("€\U0001F600z", "\ufffd") if units == 16 else ()):
            octets = text.encode("utf-16-le" if units == 16 else "latin-1")
            room = self.bits // units * units // 8
            if units == 8 or len(octets) <= room:
                out.append(int.from_bytes(octets[:room], "little"))
        if not writable:
            out += [most, most ^ 0xFF << self.bits // 2, 0xD83D, 0xDE00_D83D_0041 & most, 0xD83D_DE00 & most]
        return out


def text_of(units):
    """UTF-16 up to its first zero; a surrogate without the other one is U+FFFD."""
    out, i = "", 0
    while i < len(units) and units[i] != 0:
        low = units[i + 1] if i + 1 < len(units) else 0
        if 0xD800 <= units[i] < 0xDC00 <= low < 0xE000:
            out += chr(0x10000 + (units[i] - 0xD800 << 10) + (low - 0xDC00))
            i += 1
        else:
            out += "\ufffd" if 0xD800 <= units[i] < 0xE000 else chr(units[i])
        i += 1
    return out


@dataclass
class Pdo:
    """A PDO of a device."""
    number: int
    cob_id: int
    entries: list = field(default_factory=list)

    def frame(self, raws):
        """The data of its frame, from the bits of each entry."""
        data, at = 0, 0
        for entry, raw in zip(self.entries, raws):
            data |= raw << at
            at += entry.bits
        return data.to_bytes((at + 7) // 8, "little")


def same(found, wanted):
    """Whether both are the same value of the same type; NaN is the same as any other NaN."""
    if type(found) is not type(wanted):
        return False
    if isinstance(wanted, float):
        return found != found and wanted != wanted or struct.pack("<d", found) == struct.pack("<d", wanted)
    return found == wanted


def pdos_of(eds, inputs):
    """The TPDOs (inputs) or RPDOs of an EDS with plain numbers."""
    file = configparser.ConfigParser(interpolation=None)
    file.read_string(eds)
    out = []
    communication, mapping = (0x1800, 0x1A00) if inputs else (0x1400, 0x1600)
    for number in range(1, 513):
        section = f"{communication + number - 1:X}sub1"
        if section not in file:
            break
        pdo = Pdo(number, int(file[section]["DefaultValue"], 0) & 0x7FF)
        first = f"{mapping + number - 1:X}sub"
        for i in range(1, int(file[first + "0"]["DefaultValue"], 0) + 1):
            mapped = int(file[f"{first}{i}"]["DefaultValue"], 0)
            about = file[f"{mapped >> 16:X}"]
            pdo.entries.append(Entry(mapped >> 16, about["ParameterName"], TYPES[int(about["DataType"], 0)][0],
                                     mapped & 0xFF))
        out.append(pdo)
    return out


class Device:
    """Objects of random types in random PDOs."""
    WORDS = ("Valve", "24V (aux)", "class", "x  --  y", "Druck/p", "_flag_", "A.B")

    def __init__(self, random, first_cob_id, inputs=(), outputs=()):
        """inputs, outputs: names of types that it has in any case."""
        self.random, self.index = random, 0x2000
        self.inputs = self._pdos(first_cob_id, inputs)
        self.outputs = self._pdos(first_cob_id + len(self.inputs), outputs)

    def _pdos(self, first_cob_id, types):
        out, least, sizes = [], self.random.randint(3, 6), dict(TYPES.values())
        wanted = list(types)
        while wanted or len(out) < least:
            pdo, room = Pdo(len(out) + 1, first_cob_id + len(out)), 64
            while not pdo.entries or wanted or (room > 0 and self.random.random() < 0.8):
                name = wanted[0] if wanted else self.random.choice(list(sizes))
                bits = sizes[name] or self.random.choice(self._widths(name))
                if bits > room and wanted:
                    break
                if bits <= room:
                    self.index += 1
                    pdo.entries.append(Entry(self.index, f"{self.random.choice(self.WORDS)} {self.index:X}", name, bits))
                    room -= bits
                    wanted = wanted[1:]
            out.append(pdo)
        return out

    @staticmethod
    def _widths(name):
        """Bits of an object without a fixed size."""
        return list(range(1, 65)) if name == "OCTET_STRING" else [16, 32, 48, 64]

    def values(self, pdos, writable):
        """Bits of all entries, by PDO: at a limit, or any."""
        def bits(entry):
            if self.random.random() < 0.5 or not entry.type.startswith(("INTEGER", "UNSIGNED", "OCTET", "DOMAIN")):
                return self.random.choice(entry.values(writable))
            return self.random.getrandbits(entry.bits)
        return [[bits(entry) for entry in pdo.entries] for pdo in pdos]

    def eds(self):
        """Its device file."""
        sections, objects = [], []
        codes = {name: code for code, (name, _) in TYPES.items()}

        def variable(section, name, kind, access, value, mappable=0):
            default = "" if value is None else f"\nDefaultValue={value}"
            sections.append(f"[{section}]\nParameterName={name}\nObjectType=7\nDataType={codes[kind]}\nAccessType={access}"
                            f"{default}\nPDOMapping={mappable}")

        def record(index, values):
            objects.append(index)
            sections.append(f"[{index:X}]\nParameterName=PDO\nObjectType=9\nSubNumber={len(values) + 1}")
            variable(f"{index:X}sub0", "Count", "UNSIGNED8", "rw", len(values))
            for i, (kind, value) in enumerate(values, 1):
                variable(f"{index:X}sub{i:X}", "Entry", kind, "rw", value)
        variable("1000", "Device type", "UNSIGNED32", "ro", 0)
        variable("1001", "Error register", "UNSIGNED8", "ro", 0)
        variable("1017", "Heartbeat time", "UNSIGNED16", "rw", 0)
        objects.append(0x1017)
        for first, pdos, no_rtr in ((0x1400, self.outputs, 0), (0x1800, self.inputs, 1 << 30)):
            for pdo in pdos:
                record(first + pdo.number - 1, [("UNSIGNED32", pdo.cob_id | no_rtr), ("UNSIGNED8", 254)])
                record(first + 0x200 + pdo.number - 1,
                       [("UNSIGNED32", entry.index << 16 | entry.bits) for entry in pdo.entries])
                for entry in pdo.entries:
                    objects.append(entry.index)
                    variable(f"{entry.index:X}", entry.name, entry.type, "ro" if no_rtr else "rw", None, 1)
        listed = "\n".join(f"{i}=0x{index:X}" for i, index in enumerate(objects, 1))
        return ("[FileInfo]\nFileName=random.eds\n[DeviceInfo]\nVendorName=Test\nProductName=Random\nGranularity=1\n"
                "[MandatoryObjects]\nSupportedObjects=2\n1=0x1000\n2=0x1001\n"
                f"[OptionalObjects]\nSupportedObjects={len(objects)}\n{listed}\n" + "\n".join(sections) + "\n")
