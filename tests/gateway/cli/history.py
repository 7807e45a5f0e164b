#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""A gateway with a journal is killed, stopped and started again; `linegate history` has the events of all runs, and each
event number once.

history.py LINEGATED LINEGATE PROFILES
"""

import collections
import json
import subprocess

from plant_process import Failure, Plant, expect, run_test, until, write

PLANT = """schema: 1
gateway: {{name: journal}}
journal: {{file: {file}}}
lines:
  - name: press
    interface: "simulated:"
    access: all
    simulate: [{{node: 8, profile: digital-io}}]
"""


class History:
    def __init__(self, linegate, file):
        self.words = [linegate, "--json", "history", "--journal", file]

    def events(self, *words):
        done = subprocess.run([*self.words, *words], capture_output=True, text=True, check=False)
        return [json.loads(line) for line in done.stdout.splitlines()] if done.returncode == 0 else []

    def await_kind(self, kind, times):
        """Waits until that many events of the kind are stored."""
        until(f"{times} events {kind}", lambda: len(self.events("--kind", kind)) == times)


def numbers_by_line(events):
    out = collections.defaultdict(list)
    for event in events:
        out[event["line"]].append(event["number"])
    return out


def test(folder, linegated, linegate, profiles):
    file = f"{folder}/journal.db"
    history = History(linegate, file)
    plant = Plant(linegated, linegate, profiles, "0")
    path = write(f"{folder}/plant.yaml", PLANT.format(file=file))

    killed = plant.gateway(path)
    history.await_kind("line-started", 1)
    history.await_kind("journal-state", 1)
    killed.kill()
    killed.wait()
    with plant.running(path):
        history.await_kind("line-started", 2)
    stopped = numbers_by_line(history.events())
    with plant.running(path):
        plant.text("nmt", "start", "press:all")
        history.await_kind("command-accepted", 1)
        history.await_kind("line-started", 3)

    events = history.events()
    expect("the number of streams", len({event["stream"] for event in events}), 1)
    expect("the number of incarnations", len({event["incarnation"] for event in events}), 3)
    for line, numbers in numbers_by_line(events).items():
        if numbers != sorted(set(numbers)):
            raise Failure(f"numbers of '{line}': {numbers}")
        newest = stopped[line][-1]
        expect(f"the numbers of '{line}' after a stop", numbers[len(stopped[line])], newest + 1)
    expect("the reason of the first stream", [event["text"].split(" ", 2)[2] for event in
                                              history.events("--kind", "journal-state")],
           ["begins a new stream of event numbers",
            "stores events; the last run did not end in order: its events of the last second, or since the disk failed, "
            "may be missing"])
    accepted = history.events("--kind", "command-accepted")[0]["text"]
    if "command nmt of " not in accepted or " at " not in accepted:
        raise Failure(f"no client is named: {accepted}")


if __name__ == "__main__":
    run_test(test, own_network=True)
