#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Lines with random devices, read by name in Fast DDS (dynamic types), Cyclone DDS (types that idlc generates) and Python: the
types are what `linegate idl` prints. A stranger on each bus sends the inputs; Python writes the outputs. Plants with an odd
seed have DDS in a process of its own.

random_plants.py BUILD LINEGATED LINEGATE DYNAMIC_READER PROFILES INTEROP_LIBRARIES. LINEGATE_SEED and LINEGATE_RUNS in the
environment choose other plants. In a separate network namespace.
"""

import contextlib
import os
import random
import re
import subprocess
import sys
import threading
import time

FOLDER = os.path.dirname(os.path.abspath(__file__))
sys.path += [os.path.join(FOLDER, "..", "gateway", "cli"), os.path.join(FOLDER, "..", "deploy"), FOLDER]
from cia_types import TYPES, Device, same  # noqa: E402 pylint: disable=wrong-import-position
from installed_client import Installed, output  # noqa: E402 pylint: disable=wrong-import-position
from plant_process import (end, expect, own_domain, run_test, until, until_none,  # noqa: E402 pylint: disable=wrong-import-position
                           write)

LINES = ("a", "b", "c")
ROUNDS = 4
PATIENCE = 60  # seconds
CAN_SEND, CAN_LISTEN = 20, 21
PDOS, MASK = 0x180, 0x780  # COB-IDs
CYCLONE = "file://" + os.path.join(FOLDER, "cyclone.xml")

LINE = """  - name: {line}
    interface: "virtual:{line}"
    access: all
    named: {{type_information: true}}
    nodes: [{{id: 5, name: device, eds: {eds}, heartbeat: 1s}}]
  - name: {line}-device
    interface: "virtual:{line}"
    role: device
    devices: [{{id: 5, name: device, eds: {eds}}}]
  - name: {line}-stranger
    interface: "virtual:{line}"
    role: device
    access: all
    devices: [{{id: 6, name: other, eds: {other}}}]
"""

NUMBERS = {"boolean": "boolean", "octet": "byte", "int8": "byte", "short": "int16", "unsigned short": "uint16",
           "long": "int32", "unsigned long": "uint32", "long long": "int64", "unsigned long long": "uint64",
           "float": "float32", "double": "float64"}


class Idl:
    """What `linegate idl` printed: structs, and the type of each topic."""

    def __init__(self, text):
        self.structs, self.topics, topic = {}, {}, ""
        for line in text.splitlines():
            if line.startswith("// plant/"):
                topic = line[3:].split(":")[0]
            elif line.startswith("@final struct "):
                self.topics[topic] = name = line.split()[2]  # the last one is that of the topic
                self.structs[name] = []
            elif match := re.match(r"  (?:@key )?(.*) (\w+)(?:\[(\d+)\])?;", line):
                self.structs[name].append(match.groups())

    def leaves(self, struct, path=""):
        """Type, path and count of each member that is no struct."""
        for kind, name, count in self.structs[struct]:
            if kind in self.structs:
                yield from self.leaves(kind, path + name + ".")
            else:
                yield kind, path + name, count

    def xml(self):
        """The types for Fast DDS. It has no type of signed octets."""
        out = ["<types>"]
        for struct, members in self.structs.items():
            full = f"plant::{struct}" if struct in self.topics.values() else struct
            out.append(f'<type><struct name="{full}">')
            for kind, name, count in members:
                about = f'type="{NUMBERS.get(kind)}"'
                if kind in self.structs:
                    about = f'type="nonBasic" nonBasicTypeName="{kind}"'
                elif kind.startswith("string"):
                    about = f'type="string" stringMaxLength="{kind[7:-1]}"'
                about += f' arrayDimensions="{count}"' if count else ""
                out.append(f'<member name="{name}" {about}/>')
            out.append("</struct></type>")
        return "\n".join([*out, "</types>"])

    def c_reader(self):
        """A program for Cyclone DDS that prints samples as dynamic_reader does."""
        out = ['#include <inttypes.h>\n#include <stdio.h>\n#include <string.h>\n#include <unistd.h>\n#include <poll.h>\n'
               '#include "random.h"\n#include "tests/interop/cyclone.h"\n'
               'static void octets(const void* data, size_t size) {\n'
               '  for (size_t i = 0; i < size; ++i) printf("%02X", ((const uint8_t*)data)[i]);\n}\n']
        for number, struct in enumerate(self.topics.values()):
            out.append(f"static void print{number}(const plant_{struct}* s) {{\n")
            for kind, path, count in self.leaves(struct):
                out.append(f'  printf("\\t{path}=");\n  {printed(kind, f"s->{path}", count)}\n')
            out.append("}\n")
        out.append("int main(int argc, char** argv) {\n  if (argc != 2) return 2;\n"
                   "  dds_entity_t p = participant_in_domain(argv[1]);\n  dds_entity_t readers[] = {\n")
        for topic, struct in self.topics.items():
            out.append(f'    make_reader(p, &plant_{struct}_desc, "{topic}", DDS_DURABILITY_TRANSIENT_LOCAL, 1),\n')
        out.append("  };\n  struct pollfd input = {STDIN_FILENO, POLLIN, 0};\n  while (poll(&input, 1, 20) == 0) {\n"
                   "    void* s[1] = {NULL};\n    dds_sample_info_t info[1];\n")
        for number, topic in enumerate(self.topics):
            out.append(f"    if (dds_take(readers[{number}], s, info, 1, 1) == 1) {{\n      if (info[0].valid_data) {{\n"
                       f'        printf("{topic}");\n        print{number}(s[0]);\n        printf("\\n");\n      }}\n'
                       f"      dds_return_loan(readers[{number}], s, 1);\n      s[0] = NULL;\n    }}\n")
        out.append("    fflush(stdout);\n  }\n  return 0;\n}\n")
        return "".join(out)


def printed(kind, member, count):
    """C that prints a member."""
    if kind.startswith("string"):
        return f"octets({member}, strlen({member}));"
    if count:
        return f"octets({member}, {count});"
    if kind == "boolean":
        return f'printf("%s", {member} ? "true" : "false");'
    if kind in ("float", "double"):
        bits, size = ("uint32_t", 8) if kind == "float" else ("uint64_t", 16)
        return f'{{ {bits} b; memcpy(&b, &{member}, sizeof b); printf("%0{size}" PRIX64, (uint64_t)b); }}'
    if kind.startswith("unsigned") or kind == "octet":
        return f'printf("%" PRIu64, (uint64_t){member});'
    return f'printf("%" PRId64, (int64_t){member});'


class Reader:
    """A program that prints samples; the newest of each topic, by path."""

    def __init__(self, name, command, environment=None, dot="."):
        self.name, self.samples, self.dot = name, {}, dot
        self.process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env=environment)
        threading.Thread(target=self._read, daemon=True).start()

    def _read(self):
        for line in self.process.stdout:
            topic, *members = line.rstrip("\n").split("\t")
            self.samples[topic] = dict(member.split("=", 1) for member in members)

    def close(self):
        """Ends the program."""
        self.process.stdin.close()
        expect(f"exit status of {self.name}", self.process.wait(timeout=PATIENCE), 0)


def identifier_of(name):
    """The rule of bridges/named, without reserved words."""
    identifier = re.sub(r"[^0-9A-Za-z]+", "_", name).strip("_")
    return "n" + identifier if identifier[0].isdigit() else identifier


def as_printed(entry, raw, signed_octets):
    """The text of a value in the line of a reader."""
    value = entry.meaning(raw)
    if entry.type.startswith("REAL"):
        return f"{raw:0{entry.bits // 4}X}"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int):
        return str(value if signed_octets or entry.type != "INTEGER8" else raw)
    return (value.encode() if isinstance(value, str) else value).hex().upper()


class Plant:
    """Its devices, programs and values."""

    def __init__(self, seed):
        self.random = random.Random(seed)
        self.process = ("same", "own")[seed % 2]
        dealt = {direction: self._dealt() for direction in ("inputs", "outputs")}
        self.devices = {line: Device(self.random, 0x190, dealt["inputs"][i], dealt["outputs"][i])
                        for i, line in enumerate(LINES)}

    def _dealt(self):
        """Every type of CiA 301 to one of the lines."""
        names = [name for name, _ in TYPES.values()]
        self.random.shuffle(names)
        return [names[i::len(LINES)] for i in range(len(LINES))]

    def yaml(self, folder):
        """Writes its files, and returns the name of the first."""
        out = f"schema: 1\ngateway: {{name: random}}\ndds: {{process: {self.process}}}\nlines:\n"
        for line, device in self.devices.items():
            eds = write(os.path.join(folder, f"{line}.eds"), device.eds())
            out += LINE.format(line=line, eds=eds, other=os.path.join(FOLDER, "../../bridges/sim/eds/digital-io.eds"))
        return write(os.path.join(folder, "plant.yaml"), out)

    def rounds(self, client, readers):
        """Sends and writes values, and waits until all have them."""
        groups = {line: client.line(line).group("", watchdog=0) for line in LINES}
        seen = frames_on_the_buses(client)
        for _ in range(ROUNDS):
            # line, direction, entry and bits; twice line, COB-ID and data: of the inputs, and of the outputs
            wanted, frames, received = [], [], []
            for line, device in self.devices.items():
                sent = device.values(device.inputs, writable=False)
                frames += [(line, pdo.cob_id, pdo.frame(of)) for pdo, of in zip(device.inputs, sent)]
                written = device.values(device.outputs, writable=True)
                for pdo, of in zip(device.outputs, written):
                    for entry, raw in zip(pdo.entries, of):
                        groups[line].set("device." + entry.name, entry.meaning(raw))
                received += [(line, pdo.cob_id, pdo.frame(of)) for pdo, of in zip(device.outputs, written)]
                arm(client, groups[line])
                for direction, pdos, raws in (("inputs", device.inputs, sent), ("outputs", device.outputs, written)):
                    wanted += [(line, direction, entry, raw) for pdo, of in zip(pdos, raws)
                               for entry, raw in zip(pdo.entries, of)]
            await_all(client, readers, wanted, frames)
            await_frames(client, seen, received)
            client_waits(client, 1)  # at most 50 frames a second are reported
            self.compare_devices(client, wanted)

    def compare_devices(self, client, wanted):
        """The outputs in the devices. Those of ours have no RPDO with a DOMAIN, or a string whose length is not in the file."""
        absent = {(line, entry.index) for line, device in self.devices.items() for pdo in device.outputs
                  if any(entry.type == "DOMAIN" or entry.type.endswith("STRING") for entry in pdo.entries)
                  for entry in pdo.entries}
        stored = [one for one in wanted if one[1] == "outputs" and (one[0], one[2].index) not in absent]
        expect("outputs are compared in the devices", bool(stored), True)
        calls = [client.line(line).sdo_read(5, entry.index) for line, _, entry, _ in stored]
        for (line, _, entry, raw), call in zip(stored, calls):
            expect(f"{entry.name} in the device of {line}", int.from_bytes(call.result(), "little"), raw)


def frames_on_the_buses(client):
    """The last frame of each COB-ID of a PDO, by line and COB-ID, from now on."""
    seen = {}

    def received(event):
        if event.name == "can-frame":
            seen[event.line.removesuffix("-stranger"), event.code] = event.data
    client.on_event(received)
    for line in LINES:
        client.line(line + "-stranger").request(CAN_LISTEN, entry=PDOS, code=3600,
                                                 data=MASK.to_bytes(4, "little")).result()
    return seen


def await_frames(client, seen, received):
    """Waits until the last frames with the outputs are these."""
    def wrong():
        client.poll(0.05)
        return [f"{line} {cob_id:X}: {seen.get((line, cob_id))}, not {data}" for line, cob_id, data in received
                if seen.get((line, cob_id)) != data]
    until_none("all frames are right", wrong)


def client_waits(client, seconds):
    """Receives for that time."""
    end_of_time = time.monotonic() + seconds
    while time.monotonic() < end_of_time:
        client.poll(0.05)


def arm(client, group):
    """Begins to write, if it does not yet."""
    def armed():
        client.poll(0.02)
        try:
            group.arm()
        except Exception as error:  # pylint: disable=broad-except
            if getattr(error, "code", 0) != -2:
                raise
            return False
        return True
    if group.state == 0:
        until("a group is armed", armed)


def await_all(client, readers, wanted, frames):
    """Waits until Python and both readers have these values; else names those that are not. Sends the frames again
    until then: a device that was started again on a slow host sends values of its own."""
    sent = []

    def wrong():
        if not sent or time.monotonic() > sent[-1] + 2:
            for call in [client.line(line + "-stranger").request(CAN_SEND, entry=cob_id, data=data)
                         for line, cob_id, data in frames]:
                call.result()
            sent.append(time.monotonic())
        client.poll(0.05)
        out = []
        for line, direction, entry, raw in wanted:
            value = client.line(line).read(f"{direction}:device.{entry.name}")[0]
            if not (value.good and same(value.data, entry.meaning(raw))):
                out.append(f"Python: {line} {value}, not {entry.meaning(raw)!r}")
            member = identifier_of(entry.name)
            for reader in readers:
                sample = reader.samples.get(f"plant/{line}/device/{direction}", {})
                found = sample.get("values" + reader.dot + member), sample.get("valid" + reader.dot + member)
                text = as_printed(entry, raw, reader.name == "Cyclone DDS")
                if found != (text, "true"):
                    out.append(f"{reader.name}: {line} {direction} {entry.name} {entry.type}: {found}, not {text}")
        return out
    until_none("all values are right", wrong)


def cyclone_reader(folder, idl, libraries):
    """Compiles what idlc generates from that document."""
    write(os.path.join(folder, "reader.c"), idl.c_reader())
    output("idlc", "-l", "c", "random.idl", cwd=folder)
    source = os.path.join(FOLDER, "..", "..")
    output("cc", "-w", "-std=gnu11", "-O0", "-I", folder, "-I", source, "-I", os.path.join(libraries, "generated"),
           "reader.c", "random.c", os.path.join(libraries, "libinterop_cyclone.a"),
           os.path.join(libraries, "libinterop_types.a"), "-lddsc", "-o", "reader", cwd=folder)
    return os.path.join(folder, "reader")


def run_plant(linegate, folder, seed, programs, profiles, libraries):
    plant, domain = Plant(seed), own_domain()
    linegated, console, dynamic_reader = programs
    file = plant.yaml(folder)
    text = "".join(output(console, "idl", file, line) for line in LINES)
    write(os.path.join(folder, "random.idl"), text)
    idl = Idl(text)
    types = write(os.path.join(folder, "types.xml"), idl.xml())
    topics = [word for topic, struct in idl.topics.items() for word in (topic, "plant::" + struct)]
    compiled = cyclone_reader(folder, idl, libraries)
    gateway = subprocess.Popen([linegated, file, "--dds-domain", domain, "--dds-profile", profiles])
    try:
        with contextlib.ExitStack() as stack:
            readers = [Reader("Fast DDS", [dynamic_reader, domain, profiles, "linegate", types, *topics]),
                       Reader("Fast DDS, described", [dynamic_reader, domain, profiles, "linegate"], dot="_"),
                       Reader("Cyclone DDS", [compiled, domain], {**os.environ, "CYCLONEDDS_URI": CYCLONE})]
            for reader in readers:
                stack.callback(reader.close)
            client = stack.enter_context(linegate.Client(int(domain), profile=profiles))
            for line in LINES:
                for name in (line, line + "-stranger"):
                    expect(f"{name} is ready", client.line(name).wait(PATIENCE), True)
            plant.rounds(client, readers)
    except BaseException:
        gateway.kill()
        raise
    end(gateway)


def test(folder, build, linegated, console, dynamic_reader, profiles, libraries):
    installed = Installed(build, folder)
    os.environ["LINEGATE_CLIENT_LIBRARY"] = installed.so_file
    sys.path.insert(0, installed.python)
    import linegate  # pylint: disable=import-outside-toplevel,import-error

    first = int(os.environ.get("LINEGATE_SEED", "1"), 0)
    for seed in range(first, first + int(os.environ.get("LINEGATE_RUNS", "1"), 0)):
        print(f"LINEGATE_SEED={seed} LINEGATE_RUNS=1", flush=True)
        run_plant(linegate, folder, seed, (linegated, console, dynamic_reader), profiles, libraries)


if __name__ == "__main__":
    run_test(test, own_network=True)
