#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""The Python module of the client library, installed from the build, at a gateway: with and without an event loop.

client_python.py BUILD LINEGATED. In a separate network namespace.
"""

import asyncio
import json
import os
import subprocess
import sys
import time

from installed_client import EXAMPLES, Installed, armed

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "gateway", "cli"))
from plant_process import end, expect, raised, run_test, until  # noqa: E402 pylint: disable=wrong-import-position

LAMP = "panel.Write output 8-bit.Outputs 1 to 8"
POSITION, SWITCH = "angle.Position value", "panel.Read input bit.Input 1"
PATIENCE = 60  # seconds


def without_a_loop(linegate):
    with linegate.Client(name="first") as client:
        press = client.line("press")
        expect("status at the start", press.status, linegate.LineStatus.WAITING)
        expect("a value at the start", press.read(POSITION)[0].quality, linegate.Quality.NO_LINE)
        expect("ready", press.wait(PATIENCE), True)
        expect("outputs", press.outputs()[0], LAMP)
        expect("inputs", POSITION in press.inputs(), True)
        until("values are good", lambda: client.poll(0.1) or press.read(POSITION, SWITCH).good)
        now = press.read(POSITION, SWITCH, "absent")
        expect("types", [type(value.data) for value in now.values], [int, bool, type(None)])
        expect("an absent name", now[2].quality, linegate.Quality.NO_NAME)
        expect("SDO", press.sdo_read(8, 0x1018, 1).result(), (19527).to_bytes(4, "little"))
        error = raised(linegate.CallError, press.sdo_read(8, 0x1FFF).result)
        expect("SDO abort", (error.outcome, error.reason), (linegate.Outcome.SDO_ABORT, 0x0602_0000))
        press.sdo_write(8, 0x1017, 0, (500).to_bytes(2, "little"), attempts=2).result()
        expect("SDO in several attempts", press.sdo_read(8, 0x1017, attempts=3).result(), (500).to_bytes(2, "little"))
        numbers(linegate, client, press)
        calls(linegate, client, press)
        typed(linegate, press)
        outputs(linegate, client, press)
    for function in (client.poll, lambda: press.wait(0), press.inputs, lambda: press.read(POSITION), lambda: press.sdo_read(8, 0x1018)):
        expect("closed", raised(linegate.Error, function).code, -8)
    client.close()


def typed(linegate, press):
    """Commands with typed results, to a gateway with two devices and without a journal."""
    line = linegate.commands.Commands(press)
    expect("booted", [(one.node, one.letter) for one in line.boot(8).result()], [(8, "")])
    expect("scanned", [one.node for one in line.scan().result()], [7, 8])
    identity = {(one.index, one.sub): one.value for one in line.scan(8).result()[0].values}
    expect("its vendor", identity[0x1018, 1], (19527).to_bytes(4, "little"))
    expect("compared", [one.node for one in line.compare().result()], [7, 8])
    expect("by SDO", line.write_object(8, 0x1017, 0, (500).to_bytes(2, "little")).result().way, "sdo")
    listed = line.list_objects(0x1000, 0x1018).result()
    expect("own objects", (listed[0].index, listed[0].type), (0x1000, 7))
    expect("one of them", line.read_own(0x1000, 0).result(), listed[0].value)
    expect("connections", line.connections().result(), [])
    expect("booted in words", [(one.ok, one.text != "") for one in line.boot(8).result()], [(True, True)])
    more_typed(linegate, line)
    expect("versions", "linegate" in line.versions().result(), True)
    expect("an LSS service", line.lss_inquire_node_id().result().outcome in (0, 1), True)
    error = raised(linegate.CallError, line.read_journal(line="press", severity=1, most=5).result)
    expect("without a journal", str(error), "not possible in the present state")
    expect("a node that is none", raised(linegate.CallError, line.boot(200).result).outcome, linegate.Outcome.REFUSED)


def more_typed(linegate, line):
    """What the gateway accepts, and what it refuses with its reason: the bytes of each command are those of the contract."""
    listed = linegate.commands.ListedObject(0x2000, 0, 5, 2, name="Speed", value=b"\x09")
    line.create_object(listed).result()
    expect("a created object", line.read_own(0x2000, 0).result(), b"\x09")
    line.write_own(0x2000, 0, b"\x0a").result()
    expect("listed", [(one.name, one.type, one.value, one.application) for one in line.list_objects(0x2000, 0x2000).result()],
           [("Speed", 5, b"\x0a", True)])
    line.remove_object(0x2000).result()
    expect("removed", raised(linegate.CallError, line.read_own(0x2000, 0).result).reason, 0x0602_0000)
    expect("too long a name", raised(linegate.CallError, line.create_object(
        linegate.commands.ListedObject(0x2000, 0, 5, 2, name="x" * 256)).result).outcome, linegate.Outcome.REFUSED)

    def written():
        try:
            return line.write_output(LAMP, 5, attempts=2).result().way
        except linegate.CallError:
            return None  # the device was booted again, and is not Operational yet
    expect("an output", until("it is written", written), "pdo")
    refused = raised(linegate.CallError, line.write_output("absent", 5).result)
    expect("no such output", str(refused), "the line has no output or group of this name")
    expect("PDOs of an output", len(line.trigger_pdos_of(LAMP).result()), 1)
    for frame in (line.listen(1, 0x123, 0x7FF, extended=False), line.listen(1), line.listen(0, 0x123, 0x7FF, extended=False),
                  line.send_frame(0x7F0, b"\1\2"), line.send_frame(0x1234_5678, b"", extended=True),
                  line.send_frame(0x7F0, bytes(12), fd=True, bit_rate_switch=True), line.send_remote_frame(0x7F0, 8)):
        frame.result()
    for call, text in ((line.send_frame(0x7F0, bytes(9)), "data is not 0..8 bytes"),
                       (line.listen(1, 1 << 29), "identifier is not 0..1FFFFFFFh")):
        expect("out of range", str(raised(linegate.CallError, call.result)), text)
    for call in (line.check_sleep, line.sleep, line.sleep_unchecked, line.wake_up, lambda: line.object_to_sleep(True)):
        expect("sleep that is not configured", raised(linegate.CallError, call().result).outcome, linegate.Outcome.REFUSED)
    loading = line.program(8, 1, b"program")
    raised(linegate.CallError, loading.result)
    expect("what the device reported", loading.fault and loading.fault.index, 0x1F51)


def numbers(linegate, client, press):
    """None is cut to what its member holds, and no name is ignored."""
    expect("NMT of node 256", str(raised(linegate.CallError, press.nmt(256, 2).result)), "node is not 0..127")
    expect("SDO of node 264", str(raised(linegate.CallError, press.sdo_read(264, 0x1018).result)), "node is not 1..127")
    expect("index 16040h", str(raised(linegate.CallError, press.sdo_read(8, 0x16040).result)), "index is not 0..FFFFh")
    error = raised(linegate.Error, lambda: press.request(0, node=264))
    expect("a member", (error.code, str(error)), (-6, "node is not 0..255"))
    raised(TypeError, lambda: press.request(1, node=8, indx=0x6200))
    expect("data of a number", "to_bytes" in str(raised(TypeError, lambda: press.sdo_write(8, 0x6200, 1, 5))), True)
    raised(ValueError, lambda: press.read(POSITION + "\0junk"))
    for text, wrong in (("a name is a str, not list", lambda: press.read([POSITION])),
                        ("a position is a str, not int", lambda: client.events(5)),
                        (LAMP + " is a bool, int, float, str or bytes, not NoneType",
                         lambda: press.group("lamps").set(LAMP, None)),
                        ("peers is a list of str, not a str", lambda: linegate.Client(peers="127.0.0.1")),
                        ("an item of lines is a str, not int", lambda: linegate.Client(lines=[5])),
                        ("timeout is a number of seconds, not NoneType", lambda: press.sdo_read(8, 0x1018, timeout=None))):
        expect("a wrong type", str(raised(TypeError, wrong)), text)
    raised(ValueError, lambda: press.sdo_read(8, 0x1018, timeout=float("nan")))
    expect("no end", press.sdo_read(8, 0x1018, 1, timeout=float("inf")).result(), (19527).to_bytes(4, "little"))
    expect("interface", "there is no interface eth7" in str(raised(linegate.Error, lambda: linegate.Client(
        interfaces=["lo", "eth7"]))), True)
    expect("peer", "the peer no-such-host has no" in str(raised(linegate.Error, lambda: linegate.Client(
        peers=["127.0.0.1", "no-such-host"]))), True)
    expect("lines", "GATEWAY/LINE" in str(raised(linegate.Error, lambda: linegate.Client(lines=["press"]))), True)
    expect("strength", raised(linegate.Error, lambda: linegate.Client(strength=-1)).code, -6)
    for watchdog in (-1, 2_147_484):  # as milliseconds of 32 bits
        error = raised(linegate.Error, lambda seconds=watchdog: press.group("lamps", watchdog=seconds))
        expect("watchdog", (error.code, str(error)), (-1, "watchdog is not 0..2147483 s"))
    expect("reactions", raised(linegate.Error, lambda: press.group("lamps", reactions=(1 << 32) + 1)).code, -1)
    expect("one object for a line", client.line("press") is press, True)
    expect("and for a group", press.group("lamps") is press.group("lamps", watchdog=1.0), True)


def calls(linegate, client, press):
    """Call-backs, until they are cancelled; an exception of one reaches the caller of poll()."""
    seen = []
    subscription = press.on_change([POSITION], seen.append)
    until("two call-backs", lambda: client.poll(0.1) or len(seen) > 1)
    subscription.cancel()
    seen.clear()
    client.poll(0.5)
    expect("call-backs after cancel()", seen, [])
    one = press.on_change(POSITION, seen.append)
    until("a call-back for one name", lambda: client.poll(0.1) or seen)
    expect("one name", [value.name for value in seen[0].values], [POSITION])
    one.cancel()
    ended = []
    closing = press.on_change([POSITION], lambda now: ended.append(raised(linegate.Error, client.close).code))
    until("close() within a call-back", lambda: client.poll(0.1) or ended)
    expect("its code", ended[0], -1)
    closing.cancel()
    for _ in range(10):
        press.sdo_read(8, 0x1018, 1).result()
    expect("calls that are not freed", len(client._unused) < 3, True)  # pylint: disable=protected-access
    wrong = press.on_change([POSITION], lambda now: now[7])
    raised(IndexError, lambda: [client.poll(0.1) for _ in range(100)])
    wrong.cancel()


def outputs(linegate, client, press):
    lamps = press.group("lamps")
    expect("no such output", raised(linegate.Error, lamps.set, "absent", 1).code, -4)
    for value in (256, -1, 1 << 63, 1 << 64, -(1 << 64)):
        expect(f"{value} in 8 bits", raised(linegate.Error, lamps.set, LAMP, value).code, -6)
    expect("not armed", lamps.state, linegate.GroupState.IDLE)
    lamps.set(LAMP, 9)

    def armed():
        client.poll(0.1)
        try:
            lamps.arm()
        except linegate.NotReady:
            return False
        return True
    until("armed", armed)
    until("held", lambda: client.poll(0.1) or lamps.state == linegate.GroupState.HELD)
    expect("owner", lamps.owner, "first")
    until("sent", lambda: client.poll(0.1) or press.read("outputs:" + LAMP)[0].good)
    expect("output", press.read("outputs:" + LAMP)[0].data, 9)
    lamps.release()
    expect("released", lamps.state, linegate.GroupState.IDLE)


async def with_a_loop(linegate):
    failed = []
    asyncio.get_running_loop().set_exception_handler(lambda _loop, context: failed.append(context["exception"]))
    async with linegate.Client(name="second") as client:
        press, lamps = client.line("press"), client.line("press").group("lamps")
        expect("poll in a loop", raised(linegate.Error, client.poll).code, -1)
        await press.ready()
        async for change in client.lines():
            expect("change", (change.gateway, change.line), ("cell", "press"))
            break
        async for image in press.changes(POSITION):
            if image.good:
                break
        events = client.events()
        coming = asyncio.ensure_future(anext(events))
        await asyncio.sleep(0)
        await press.nmt(7, 2)
        expect("event", (await coming).line, "press")
        await press.nmt(7, 1)
        await following_ends(linegate, client)
        await another_loop(linegate, client)
        await a_cancelled_await_leaves_the_call(linegate, client)
        await lamps.hold({LAMP: 3})
        wrong = (await asyncio.gather(lamps.hold({LAMP: 9, "typo": 1}), return_exceptions=True))[0]
        expect("a wrong name", (wrong.code, str(wrong)), (-4, "typo: there is no such name"))
        expect("several calls", await asyncio.gather(*(press.sdo_read(8, 0x6200, 1) for _ in range(20))), [b"\3"] * 20)
        wrong = press.on_change([POSITION], lambda now: now[7])
        while not failed:
            await asyncio.sleep(0.1)
        expect("an exception of a call-back", type(failed[0]), IndexError)
        wrong.cancel()
        cancelled = asyncio.get_running_loop().create_future()
        cancelled.cancel()
        wrong = press.on_change([POSITION], lambda now: cancelled.result())
        while type(failed[-1]) is IndexError:
            await asyncio.sleep(0.1)
        expect("a cancelled future in a call-back", type(failed[-1]), asyncio.CancelledError)
        wrong.cancel()
        time.sleep(3)  # the loop hangs, and the watchdog of 1 s fires
        expect("hung", await lamps.ended(), "lost: its watchdog has fired, or another NMT master was active")
        await lamps.hold({LAMP: 4})
        async with linegate.Client(name="third", strength=1) as stronger:
            await stronger.line("press").group("lamps").hold({LAMP: 6})
            expect("another owner", await lamps.ended(), "lost: another client writes the group")
            expect("its output", await press.sdo_read(8, 0x6200, 1), b"\6")
            weaker = await asyncio.gather(asyncio.wait_for(lamps.hold({LAMP: 7}), 2), return_exceptions=True)
            expect("a weaker one", (type(weaker[0]), lamps.state), (asyncio.TimeoutError, linegate.GroupState.IDLE))
            expect("its output", await press.sdo_read(8, 0x6200, 1), b"\6")
    expect("closed", (await asyncio.gather(press.ready(), return_exceptions=True))[0].code, -8)
    await nobody_waits_for_ever(linegate)
    await a_cancelled_end_closes(linegate)


async def following_ends(linegate, client):
    """cancel() ends `async for`; a group that does not exist is not held for ever."""
    events = client.events()
    reader = asyncio.ensure_future(list_of(events))
    await asyncio.sleep(0.3)
    events.cancel()
    await asyncio.wait_for(reader, PATIENCE)
    absent = client.line("press").group("99")
    error = (await asyncio.gather(asyncio.wait_for(absent.hold({LAMP: 1}), PATIENCE), return_exceptions=True))[0]
    expect("group 99", (type(error), "no such" in str(error)), (linegate.GroupError, True))


async def list_of(items):
    return [item async for item in items]


async def nobody_waits_for_ever(linegate):
    """An application that ends may cancel all tasks, also the one that polls."""
    async with linegate.Client(name="fourth") as client:
        absent = asyncio.ensure_future(client.line("absent").ready())
        await asyncio.sleep(0.3)
        client._task.cancel()  # pylint: disable=protected-access
        error = (await asyncio.gather(asyncio.wait_for(absent, PATIENCE), return_exceptions=True))[0]
        expect("a cancelled poll", (type(error), error.code), (linegate.Error, -8))


async def a_cancelled_end_closes(linegate):
    """A task may be cancelled a second time while it leaves `async with`."""
    client = linegate.Client(name="fifth")

    async def use():
        async with client:
            await client.line("absent").ready()
    task = asyncio.ensure_future(use())
    await asyncio.sleep(0.3)
    task.cancel()
    await asyncio.sleep(0)  # in __aexit__
    task.cancel()
    await asyncio.wait([task])
    expect("closed", raised(linegate.Error, client.line, "press").code, -8)
    expect("entered again", (await asyncio.gather(client.__aenter__(), return_exceptions=True))[0].code, -1)


async def another_loop(linegate, client):
    """Its task cannot wake a coroutine of another loop, which would wait for ever."""
    def use():
        return asyncio.run(asyncio.wait_for(client.line("absent").ready(), PATIENCE))
    error = (await asyncio.gather(asyncio.to_thread(use), return_exceptions=True))[0]
    expect("another loop", (type(error), getattr(error, "code", 0)), (linegate.Error, -1))


async def a_cancelled_await_leaves_the_call(linegate, client):
    """asyncio.wait_for() ends the waiting, not the command."""
    call = client.line("absent").sdo_read(8, 0x1018, 1)
    error = (await asyncio.gather(asyncio.wait_for(call, 0.3), return_exceptions=True))[0]
    expect("not in time", (type(error), call.done), (asyncio.TimeoutError, False))
    call.cancel()
    error = (await asyncio.gather(call, return_exceptions=True))[0]
    expect("cancelled", (type(error), error.reason), (linegate.CallError, 13))


PLANT = """schema: 1
gateway: {{name: cell}}
journal: {{file: {journal}}}
lines:
  - name: press
    interface: "simulated:"
    access: all
    nodes:
      - id: 8
        name: panel
        eds: {eds}
        values:
          6200:1: {{alias: Level, unit: mm, scale: 0.5, offset: -10, high: 100}}
    simulate: [{{node: 8, profile: digital-io}}]
    history: {{entries: ["panel.6200:1"], min_interval: 100ms}}
    outputs:
      defaults: {{panel.Level: -4.5, "panel.6200:2": 0}}
"""


def in_units(linegate, folder, linegated):
    """A value has the same unit and scale in the layout on DDS, in the client library and in the console, and is written and
    read in it."""
    plant = os.path.join(folder, "scaled.yaml")
    with open(plant, "w", encoding="utf-8") as file:
        file.write(PLANT.format(eds=os.path.join(EXAMPLES, "../../bridges/sim/eds/digital-io.eds"),
                                journal=os.path.join(folder, "journal")))
    gateway = subprocess.Popen([linegated, plant])
    try:
        with linegate.Client() as client:
            read_and_write_in_units(linegate, client)
        console = os.path.join(os.path.dirname(linegated), "linegate")
        image = json.loads(subprocess.run([console, "--json", "image", "-o", "press"], check=True,
                                          capture_output=True).stdout)
        entry = next(one for one in image["entries"] if one["name"] == "panel.Level")
        expect("in the console", [entry[key] for key in ("value", "unit", "raw", "scale", "offset", "high", "initial")],
               [117.5, "mm", 255, 0.5, -10, 100, -4.5])
    except BaseException:
        gateway.kill()
        raise
    end(gateway)


def read_and_write_in_units(linegate, client):
    press = client.line("press")
    expect("ready", press.wait(PATIENCE), True)

    def shows(number, raw):
        value = press.read("outputs:panel.Level")[0]
        return (value.good, value.data, value.unit, value.raw) == (True, number, "mm", raw)

    until("the default", lambda: client.poll(0.1) or shows(-4.5, 11))
    group = press.group("", watchdog=0)
    expect("above its limit", raised(linegate.Error, group.set, "panel.Level", 100.5).code, -6)
    expect("below its raw value", raised(linegate.Error, group.set, "panel.Level", -10.5).code, -6)
    group.set("panel.Level", 12.5)
    until("armed", lambda: client.poll(0.1) or armed(linegate, group))
    until("12.5 mm", lambda: client.poll(0.1) or shows(12.5, 45))
    expect("in the device", press.sdo_read(8, 0x6200, 1).result(), b"\x2d")
    group.set("panel.Level", 255, raw=True)
    until("beyond its limit", lambda: client.poll(0.1) or shows(117.5, 255))
    commands = linegate.commands.Commands(press)

    def stored():
        client.poll(0.1)
        return [one for one in commands.read_journal(values=True, line="press").result().values if one.value == 255]
    until("stored", stored)
    one = stored()[0]
    expect("the stored value", (one.line, one.output, one.name, one.unit, one.bits, one.scale, one.offset),
           ("press", True, "panel.Level", "mm", 8, 0.5, -10))
    page = commands.read_journal(values=True, text="no.such").result()
    expect("an entry that is not stored", (page.values, page.unknown_entry, page.events), ([], True, []))
    expect("events", any(event.line == "press" for event in commands.read_journal().result().events), True)


def test(folder, build, linegated):
    installed = Installed(build, folder)
    os.environ["LINEGATE_CLIENT_LIBRARY"] = installed.so_file
    sys.path.insert(0, installed.python)
    import linegate  # pylint: disable=import-outside-toplevel,import-error

    gateway = subprocess.Popen([linegated, os.path.join(EXAMPLES, "plant.yaml")])
    try:
        without_a_loop(linegate)
        asyncio.run(asyncio.wait_for(with_a_loop(linegate), 2 * PATIENCE))
    except BaseException:
        gateway.kill()
        raise
    end(gateway)
    in_units(linegate, folder, linegated)


if __name__ == "__main__":
    run_test(test, own_network=True)
