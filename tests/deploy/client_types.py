#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""A value of every CiA type by name in Python, at its limits. The inputs are frames that a stranger on the bus sends; what the
outputs are is read from the device over SDO, so neither depends on how the product converts values.

client_types.py BUILD LINEGATED. In a separate network namespace.
"""

import os
import subprocess
import sys
import time

from installed_client import EXAMPLES, Installed, armed

FOLDER = os.path.dirname(os.path.abspath(__file__))
sys.path += [os.path.join(FOLDER, "..", "gateway", "cli"), os.path.join(FOLDER, "..", "interop")]
from cia_types import TYPES, pdos_of, same  # noqa: E402 pylint: disable=wrong-import-position
from plant_process import end, expect, raised, run_test, until, until_none, write  # noqa: E402 pylint: disable=wrong-import-position

EDS = os.path.join(FOLDER, "..", "bridges", "named", "every_type.eds")
PATIENCE = 60  # seconds
CAN_SEND, CAN_LISTEN = 20, 21
OUT_OF_RANGE, WRONG_TYPE = -6, -5

PLANT = """schema: 1
gateway: {{name: types}}
lines:
  - name: press
    interface: "virtual:types"
    access: all
    nodes: [{{id: 5, name: every, eds: {eds}, heartbeat: 100ms}}]
  - name: device
    interface: "virtual:types"
    role: device
    devices: [{{id: 5, name: every, eds: {eds}}}]
  - name: stranger
    interface: "virtual:types"
    role: device
    access: all
    devices: [{{id: 6, name: other, eds: {other}}}]
"""


def rounds(pdos, writable):
    """Bits of all entries, by PDO, as often as one of them has another value."""
    values = [[entry.values(writable) for entry in pdo.entries] for pdo in pdos]
    most = max(len(one) for pdo in values for one in pdo)
    return [[[one[i % len(one)] for one in pdo] for pdo in values] for i in range(most)]


def await_values(client, line, names, entries, raws, send=lambda: None):
    """Waits until each value is good and that of its bits; else names those that are not. Calls `send` at once, and every 2 s:
    a device that was started again on a slow host sends values of its own."""
    wanted = [entry.meaning(raw) for entry, raw in zip(entries, raws)]
    sent = []

    def wrong():
        if not sent or time.monotonic() > sent[-1] + 2:
            send()
            sent.append(time.monotonic())
        client.poll(0.05)
        return [f"{value}, not {one!r}" for value, one in zip(line.read(*names).values, wanted)
                if not (value.good and same(value.data, one))]
    until_none("all values are right", wrong)


def inputs(client, pdos):
    press, stranger = client.line("press"), client.line("stranger")
    entries = [entry for pdo in pdos for entry in pdo.entries]
    names = ["every." + entry.name for entry in entries]
    expect("inputs", sorted(press.inputs()), sorted(names))
    for raws in rounds(pdos, writable=False):
        frames = [(pdo.cob_id, pdo.frame(of)) for pdo, of in zip(pdos, raws)]

        def send(frames=frames):
            for call in [stranger.request(CAN_SEND, entry=cob_id, data=data) for cob_id, data in frames]:
                call.result()
        await_values(client, press, names, entries, [raw for of in raws for raw in of], send)


def outputs(linegate, client, pdos):
    press = client.line("press")
    entries = [entry for pdo in pdos for entry in pdo.entries]
    expect("outputs", sorted(press.outputs()), sorted("every." + entry.name for entry in entries))
    group = press.group("", watchdog=0)
    # A device of ours has no DOMAIN in its PDOs, so that one is read from the bus.
    domain = next(pdo for pdo in pdos if pdo.entries[0].type == "DOMAIN")
    frames = []
    client.on_event(lambda event: frames.append(event.data) if event.name == "can-frame" else None)
    client.line("stranger").request(CAN_LISTEN, entry=domain.cob_id, code=3600).result()
    for i, raws in enumerate(rounds(pdos, writable=True)):
        flat = [raw for of in raws for raw in of]
        for entry, raw in zip(entries, flat):
            group.set("every." + entry.name, entry.meaning(raw))
        if i == 0:
            until("armed", lambda: client.poll(0.05) or armed(linegate, group))
        names = ["outputs:every." + entry.name for entry in entries]
        await_values(client, press, names, entries, flat)
        until("frames of the DOMAIN are right", lambda wanted=domain.frame(raws[pdos.index(domain)]): client.poll(
            0.05) or (frames and frames[-1] == wanted))
        stored = [(entry, raw) for entry, raw in zip(entries, flat) if entry.type != "DOMAIN"]
        calls = [press.sdo_read(5, entry.index) for entry, _ in stored]
        for (entry, raw), call in zip(stored, calls):
            expect(f"{entry.name} in the device", call.result().rstrip(b"\0"),
                   raw.to_bytes(8, "little").rstrip(b"\0"))
    refusals(linegate, group, entries)


def refusals(linegate, group, entries):
    """What a type cannot have is not cut."""
    for entry in entries:
        name, most = "every." + entry.name, (1 << entry.bits) - 1
        wrong = {"INTEGER": [(most >> 1) + 1, -(most >> 1) - 2, 0.5], "UNSIGNED": [most + 1, -1], "BOOLEAN": [2, -1],
                 "TIME": [-1], "VISIBLE": ["123456789", "€"], "UNICODE": ["12345", "123\U0001F600"],
                 "REAL32": [1e300], "OCTET": [b"1234567", b"123456789"], "DOMAIN": [b"", b"123456789"]}
        for kind, values in wrong.items():
            for value in values if entry.type.startswith(kind) else []:
                expect(f"{value!r} for {name}", raised(linegate.Error, group.set, name, value).code, OUT_OF_RANGE)
        if not entry.type.startswith(("VISIBLE", "UNICODE", "OCTET", "DOMAIN")):
            expect(f"a text for {name}", raised(linegate.Error, group.set, name, "1").code, WRONG_TYPE)


def test(folder, build, linegated):
    installed = Installed(build, folder)
    os.environ["LINEGATE_CLIENT_LIBRARY"] = installed.so_file
    sys.path.insert(0, installed.python)
    import linegate  # pylint: disable=import-outside-toplevel,import-error

    with open(EDS, encoding="utf-8") as file:
        eds = file.read()
    tpdos, rpdos = pdos_of(eds, inputs=True), pdos_of(eds, inputs=False)
    for pdos in (tpdos, rpdos):
        expect("types", {entry.type for pdo in pdos for entry in pdo.entries}, {name for name, _ in TYPES.values()})
    plant = write(os.path.join(folder, "plant.yaml"), PLANT.format(
        eds=EDS, other=os.path.join(EXAMPLES, "..", "..", "bridges", "sim", "eds", "digital-io.eds")))
    gateway = subprocess.Popen([linegated, plant])
    try:
        with linegate.Client() as client:
            for name in ("press", "stranger"):
                expect(f"{name} is ready", client.line(name).wait(PATIENCE), True)
            inputs(client, tpdos)
            outputs(linegate, client, rpdos)
    except BaseException:
        gateway.kill()
        raise
    end(gateway)


if __name__ == "__main__":
    run_test(test, own_network=True)
