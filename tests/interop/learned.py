#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Named topics of lines whose layout is in no file: of an observer that learns the mapping that a master writes, or
only the frames of a PDO that is in no file, and of a line that applies the result of a scan. Fast DDS reads them with
the types that are described over DDS; the values are those of the client library, and those that were written.

learned.py BUILD LINEGATED LINEGATE DYNAMIC_READER PROFILES. In a separate network namespace.
"""

import os
import subprocess
import sys

FOLDER = os.path.dirname(os.path.abspath(__file__))
sys.path += [os.path.join(FOLDER, "..", "gateway", "cli"), os.path.join(FOLDER, "..", "deploy"), FOLDER]
from installed_client import Installed  # noqa: E402 pylint: disable=wrong-import-position
from plant_process import (EDS, Console, end, expect, own_domain, run_test, until, until_none,  # noqa: E402 pylint: disable=wrong-import-position
                           write)
from random_plants import PATIENCE, Reader, identifier_of  # noqa: E402 pylint: disable=wrong-import-position

# The master maps the inputs of the panel in the reverse order, which its device file does not say.
PLANT = f"""schema: 1
gateway: {{name: learned}}
lines:
  - name: press
    interface: "virtual:press"
    access: all
    nodes:
      - {{id: 8, name: panel, eds: {EDS}/digital-io.eds, heartbeat: 200ms, pdos: {{tpdo1: {{map: ["6000:2", "6000:1"]}}}}}}
  - name: devices
    interface: "virtual:press"
    role: device
    access: all
    devices: [{{id: 8, name: panel, eds: {EDS}/digital-io.eds}}]
  - name: ear
    interface: "virtual:press"
    role: observer
    named: {{type_information: true}}
    nodes: [{{id: 8, name: panel, eds: {EDS}/digital-io.eds}}]
  - name: bare
    interface: "simulated:"
    access: all
    named: {{type_information: true}}
    simulate: [{{node: 8, profile: digital-io}}, {{node: 5, profile: drive}}]
"""
# TPDO 4 of the panel, which its device file does not have
UNKNOWN, FRAME = 0x488, bytes.fromhex("0102030405060708")


def matches(text, value):
    """Whether a member of a sample, as dynamic_reader prints it, is that value of the client library."""
    if isinstance(value, bool):
        return text == ("true" if value else "false")
    if isinstance(value, int):
        return text in (str(value), str(value & 0xFF) if -0x80 <= value < 0 else str(value))  # int8 is an octet there
    if isinstance(value, bytes):  # of an entry without a type: an unsigned number, or octets
        return text == str(int.from_bytes(value, "little")) or text == value.hex().upper()
    return False


def differences(client, reader, name, direction):
    """The values and marks of a line that its samples do not have; a sentence if there are none."""
    client.poll(0.05)
    line = client.line(name)
    names = line.inputs() if direction == "inputs" else line.outputs()
    out = [] if names else [f"{name} has no {direction}"]
    for entry, value in zip(names, line.read(*[f"{direction}:{entry}" for entry in names]).values):
        device, of_device = entry.split(".", 1)
        sample = reader.samples.get(f"plant/{name}/{device}/{direction}", {})
        member = identifier_of(of_device)
        found = sample.get("values_" + member), sample.get("valid_" + member)
        if value.good != (found[1] == "true") or not (matches(found[0], value.raw) if value.good else found[0] == "0"):
            out.append(f"{name} {direction} {entry}: {found}, not {value.raw!r} ({value.quality.text})")
    return out


def of_an_observer(linegate, client, reader_of):
    press, ear, devices = (client.line(name) for name in ("press", "ear", "devices"))
    for line in (press, ear, devices):
        expect(f"{line.name} is ready", line.wait(PATIENCE), True)
    panel = [name for name in devices.outputs() if name.startswith("panel.Read input 8-bit")]
    learned = [name for name in press.inputs() if name.startswith("panel.")]
    expect("what the master maps", learned[:2], [panel[1], panel[0]])
    frames = linegate.commands.Commands(press)

    def is_learned():
        client.poll(0.1)
        frames.send_frame(UNKNOWN, FRAME).result()  # three of a PDO that no file has
        return [name for name in ear.inputs() if name not in raw_names()] == learned and raw_names()

    def raw_names():
        return [name for name in ear.inputs() if "COB-ID" in name]
    until("the observer has the mapping of the master, and the unknown PDO", is_learned)
    reader = reader_of()
    linegate.commands.Commands(devices).write_output(panel[0], 0xA5).result()
    until("the input of the panel", lambda: client.poll(0.1) or ear.read(panel[0])[0].data == 0xA5)
    until_none("the inputs of the observer are those on the bus", lambda: differences(client, reader, "ear", "inputs"))
    values = reader.samples["plant/ear/panel/inputs"]
    first, second = (values["values_" + identifier_of(name.split(".", 1)[1])] for name in panel[:2])
    expect("what the device sent", (first, second), ("165", "0"))
    (raw,) = raw_names()
    expect("the bytes of the unknown PDO", values["values_" + identifier_of(raw.split(".", 1)[1])],
           str(int.from_bytes(FRAME, "little")))
    return reader


def of_a_scan(linegate, client, console, reader):
    bare = client.line("bare")
    expect("bare is ready", bare.wait(PATIENCE), True)
    expect("nothing before the scan", (bare.inputs(), [topic for topic in reader.samples if "/bare/" in topic]), ([], []))
    console.command("scan", "bare", "--apply")
    until("the layout of the scan", lambda: client.poll(0.1) or len(bare.inputs()) > 1 and len(bare.outputs()) > 1)
    first, second = [name for name in bare.outputs() if "6200" in name]
    commands = linegate.commands.Commands(bare)
    topic = f"plant/bare/{first.split('.', 1)[0]}/outputs"

    def shows(marks, *wanted):
        """Whether its newest sample has these members of both outputs."""
        client.poll(0.1)
        sample = reader.samples.get(topic, {})
        return [sample.get(f"{mark}_{identifier_of(name.split('.', 1)[1])}") for name in (first, second)
                for mark in marks] == list(wanted)

    def written(name, value):
        client.poll(0.1)
        try:
            return commands.write_output(name, value).result().way == "pdo"
        except linegate.CallError:
            return False  # the device is not Operational yet
    until("the first output is written", lambda: written(first, 9))
    until("each waits for the second one", lambda: shows(("valid", "known", "waits"), "false", "true", "2", "false", "false", "1"))
    until("the second output is written", lambda: written(second, 6))
    until("both are valid", lambda: shows(("values", "valid", "waits"), "9", "true", "0", "6", "true", "0"))
    until("inputs are valid", lambda: client.poll(0.1) or bare.read(*[
        name for name in bare.inputs() if name.startswith(first.split(".", 1)[0])]).good)
    until_none("the inputs are those of the image", lambda: differences(client, reader, "bare", "inputs"))


def test(folder, build, linegated, console, dynamic_reader, profiles):
    installed = Installed(build, folder)
    os.environ["LINEGATE_CLIENT_LIBRARY"] = installed.so_file
    sys.path.insert(0, installed.python)
    import linegate  # pylint: disable=import-outside-toplevel,import-error

    domain = own_domain()
    file = write(os.path.join(folder, "plant.yaml"), PLANT)
    gateway = subprocess.Popen([linegated, file, "--dds-domain", domain, "--dds-profile", profiles])
    try:
        with linegate.Client(int(domain), profile=profiles) as client:
            reader = of_an_observer(linegate, client, lambda: Reader(
                "Fast DDS", [dynamic_reader, domain, profiles, "linegate"]))
            of_a_scan(linegate, client, Console(console, profiles, domain), reader)
            reader.close()
    except BaseException:
        gateway.kill()
        raise
    end(gateway)


if __name__ == "__main__":
    run_test(test, own_network=True)
