#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""A gateway with a journal is killed, stopped and started again; `linegate history` has the events of all runs, and each
event number once. So it has over DDS, with the same conditions, and while the gateway is killed and started again.
The values of an entry are valid in each run, and end with it.

history.py LINEGATED LINEGATE PROFILES
"""

import collections
import json
import subprocess

from plant_process import EDS, Failure, Plant, expect, run_test, until, write

HISTORY = """nodes: [{id: 8, name: panel, eds: %s/digital-io.eds,
        values: {"6000:1": {unit: bar, scale: 0.5, offset: 1}}}]
    history: ["panel.*"]""" % EDS
PLANT = """schema: 1
gateway: {{name: journal}}
{journal}
dds: {{process: {process}}}
lines:
  - name: press
    interface: "simulated:"
    access: all
    simulate: [{{node: 8, profile: digital-io}}]
    {history}
"""


INPUT = "panel.Read input 8-bit.Inputs 1 to 8"


class History:
    def __init__(self, linegate, file):
        self.words = [linegate, "--json", "history", "--journal", file]

    def values(self, *words):
        return self.events(*words, "--values", INPUT)

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


def over_dds(plant, *words):
    """The events that gateways answer, without the names of the gateways, which must be there."""
    events = plant.stream("history", *words)
    for event in events:
        expect("the gateway of an event", event.pop("gateway"), "journal")
    return events


def same_over_dds(plant, history):
    """Each condition selects over DDS what it selects in the file."""
    kind = ["--kind", "line-started"]
    until("the journal to be the same twice", lambda: history.events() == over_dds(plant))
    for words in [kind, [*kind, "-n", "1"], [*kind, "press"], [*kind, "--node", "press:0"], [*kind, "--text", "PRESS"],
                  ["--node", "press:8", "--kind", "boot-up"], [*kind, "--severity", "error"],
                  [*kind, "--since", "yesterday"], [*kind, "--until", "today"], ["--kind", "gateway-started"]]:
        expect(f"events over DDS with {words}", over_dds(plant, *words), history.events(*words))
    expect("the newest event", over_dds(plant, *kind, "-n", "1"), over_dds(plant, *kind)[-1:])
    expect("the gateway of a line", over_dds(plant, "journal/press", *kind), history.events(*kind))
    for words, error in [(["--since", "tomorrow"], "is no time"), (["--node", "x"], "is no node"),
                         (["elsewhere/press"], "no gateway of line 'elsewhere/press'")]:
        told = plant.ask("history", *words)
        if told.returncode == 0 or error not in told.stderr:
            raise Failure(f"{words}: {told.returncode} {told.stderr}")


def same_values_over_dds(plant, history):
    """Values by each condition, over DDS and from the file."""
    until("a value that is valid again", lambda: history.values()[-1]["valid"])
    until("the newest value to be the last one", lambda: history.values("-n", "1") == history.values()[-1:])
    newest = history.values("-n", "1")
    expect("its unit", (newest[0]["unit"], newest[0]["value"]), ("bar", 0.5 * newest[0]["raw"] + 1))
    for words in [["--values", INPUT], ["press", "--values"], ["--values", "panel.*", "-n", "3"],
                  ["--node", "press:8", "--until", newest[0]["time"][:19] + "Z", "--values"], ["--since", "yesterday", "--values"]]:
        until(f"the same values with {words}", lambda chosen=words: over_dds(plant, *chosen) == history.events(*chosen))
    def csv():
        return plant.command("history", "--values", INPUT, "--csv").stdout.splitlines()
    expect("the head of CSV", csv()[0], "time,gateway,line,direction,entry,value,unit")
    until("a line of CSV for each value", lambda: len(csv()) == len(history.values()) + 1)
    for words, error in [(["--values", "nowhere"], 'no values of "nowhere" are stored'),
                         (["--values", "--kind", "emcy"], "values have no kind")]:
        told = plant.ask("history", *words)
        if told.returncode == 0 or error not in told.stderr:
            raise Failure(f"{words}: {told.returncode} {told.stderr}")


class Follower:
    """`linegate history --follow` in the background."""

    def __init__(self, plant, folder, *words):
        self.path = f"{folder}/followed"
        self.output = open(self.path, "w", encoding="utf-8")
        self.process = subprocess.Popen([*plant.console, "--json", "--timeout", "1", "history", "--follow", *words],
                                        stdout=self.output, stderr=subprocess.DEVNULL)

    def numbers(self):
        with open(self.path, encoding="utf-8") as file:
            return [json.loads(line)["number"] for line in file if line.endswith("\n")]


def test_followed(folder, plant, path, history):
    """Follows while the gateway is killed and another one continues its journal."""
    kind = ["press", "--kind", "line-started"]
    before = [event["number"] for event in history.events(*kind)]
    first = plant.gateway(path)
    history.await_kind("line-started", len(before) + 1)
    follower = Follower(plant, folder, *kind, "-n", "1")
    until("the newest event", lambda: len(follower.numbers()) == 1)
    first.kill()
    first.wait()
    with plant.running(path):
        history.await_kind("line-started", len(before) + 2)
        until("the event of the next run", lambda: len(follower.numbers()) == 2)
        numbers = [event["number"] for event in history.events(*kind)]
        expect("the followed events", follower.numbers(), numbers[-2:])
        follower.process.terminate()
        expect("the end of history --follow", follower.process.wait(), 0)


def test_without_journal(folder, plant):
    path = write(f"{folder}/without.yaml", PLANT.format(journal="", process="same", history=""))
    with plant.running(path):
        told = plant.command("history", code=1)
        expect("the answer of a gateway without a journal", told.stderr,
               "journal: this gateway has no journal (journal: in its plant.yaml)\n")


def test(folder, linegated, linegate, profiles):
    file = f"{folder}/journal.db"
    history = History(linegate, file)
    plant = Plant(linegated, linegate, profiles, "0")
    journal = f"journal: {{file: {file}}}"
    path = write(f"{folder}/plant.yaml", PLANT.format(journal=journal, process="same", history=HISTORY))
    own_process = write(f"{folder}/own.yaml", PLANT.format(journal=journal, process="own", history=HISTORY))

    killed = plant.gateway(path)
    history.await_kind("line-started", 1)
    history.await_kind("journal-state", 1)
    until("values are stored", history.values)
    killed.kill()
    killed.wait()
    with plant.running(path):
        history.await_kind("line-started", 2)
    stopped = numbers_by_line(history.events())
    with plant.running(path):
        plant.text("nmt", "start", "press:all")
        history.await_kind("command-accepted", 1)
        history.await_kind("line-started", 3)
        same_over_dds(plant, history)
        same_values_over_dds(plant, history)

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

    valid = [value["valid"] for value in history.values()]
    if valid[0] is not True or valid[-1] is not False or valid.count(False) < 2:
        raise Failure(f"values that do not end with their run: {valid}")

    with plant.running(own_process):
        history.await_kind("line-started", 4)
        same_over_dds(plant, history)
        same_values_over_dds(plant, history)
    test_followed(folder, plant, own_process, history)
    test_without_journal(folder, plant)


if __name__ == "__main__":
    run_test(test, own_network=True)
