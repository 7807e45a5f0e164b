#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Events by the Python module of the client library: an application that was away, while the gateway was killed and events
happened, goes on where it left off.

client_events.py BUILD LINEGATED. In a separate network namespace.
"""

import asyncio
import os
import subprocess
import sys

from installed_client import Installed, example_plant

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "gateway", "cli"))
from plant_process import end, expect, raised, run_test  # noqa: E402 pylint: disable=wrong-import-position

PATIENCE = 120  # seconds


async def events_of(client, after, is_last):
    """The events of the line after that position, up to the last one, and the position there."""
    reader, out = client.events(after), []
    async for event in reader:
        if event.line == "press":
            out.append(event)
            if is_last(event):
                return out, reader.position
    return None


async def is_stored():
    """The journal may lose the last second."""
    await asyncio.sleep(2)


async def operational(client):
    """Waits until the node `angle` is Operational: one that still boots is started after it was stopped."""
    press, position = client.line("press"), "angle.Position value"
    await press.ready()
    while position not in press.inputs() or not press.read(position).good:
        await asyncio.sleep(0.05)


async def events_are_followed(linegate, gateway):
    async with linegate.Client(name="reader") as client:
        reader = client.events()
        await operational(client)
        await client.line("press").nmt(7, 2)
        async for event in reader:
            if "(angle): stopped" in event.text:
                break
        await is_stored()
    gateway.kill()
    gateway.start()
    async with linegate.Client(name="other") as client:
        await client.line("press").ready()
        await client.line("press").nmt(8, 2)
        await is_stored()
    gateway.kill()
    gateway.start()
    async with linegate.Client(name="reader") as client:
        await operational(client)
        await client.line("press").nmt(7, 2)
        events, position = await events_of(client, reader.position, lambda one: one.number > 32768 and
                                           "(angle): stopped" in one.text)
        expect("starts of the line", sum(one.text == "started as manager" for one in events), 2)
        expect("numbers that were left out", [one.number for one in events if one.missed or one.journal_lost],
               [16385, 32769])
        everything, _ = await events_of(client, "", lambda one: one == events[-1])
        expect("what follows the last one of before", everything[-len(events) - 1:], [event, *events])
        await client.line("press").nmt(7, 1)
        later, _ = await events_of(client, position, lambda one: "(angle): operational" in one.text)
        expect("the next one", later[0].number, events[-1].number + 1)
        expect("no position", raised(linegate.Error, client.events, "nonsense").code, -1)
        kept = []
        client.follow_events(kept.append)
        await client.line("press").nmt(7, 2)
        while not any("(angle): stopped" in one.text for one in kept):
            await asyncio.sleep(0.1)


class Gateway:
    """With a journal."""

    def __init__(self, folder, linegated):
        plant = example_plant(folder, f"journal: {{file: {folder}/journal}}\n")
        self.command, self.process = [linegated, plant], None

    def start(self):
        self.process = subprocess.Popen(self.command)

    def kill(self):
        self.process.kill()
        self.process.wait()


def test(folder, build, linegated):
    installed = Installed(build, folder)
    os.environ["LINEGATE_CLIENT_LIBRARY"] = installed.so_file
    sys.path.insert(0, installed.python)
    import linegate  # pylint: disable=import-outside-toplevel,import-error

    gateway = Gateway(folder, linegated)
    gateway.start()
    try:
        asyncio.run(asyncio.wait_for(events_are_followed(linegate, gateway), PATIENCE))
    except BaseException:
        gateway.kill()
        raise
    end(gateway.process)


if __name__ == "__main__":
    run_test(test, own_network=True)
