#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""One round of ../power_cuts: checks the journal on the disk against what was read from it before the power was cut,
then writes it again until the power is cut.

A gateway observes a bus on which a device reports errors, and stores each as an event; its log goes to the output. A
reader in another process prints the events that are committed, as JSON. The next round has this output: each event that
was read is still there, unchanged; of the events that the log names, only the newest are missing, those of the last
second; the numbers increase, none is used twice; and the gateway reports that its last run did not end in order."""

import argparse
import datetime
import json
import os
import re
import subprocess
import threading

from actors import Actor, Failed, check, eventually, play, run, write_file

EDS = os.path.abspath(os.path.join(os.path.dirname(__file__), "../../../bridges/sim/eds"))
DISK = "/run/disk"
JOURNAL = f"{DISK}/journal.db"
NODE = 5
MOST_LOST = 1.0  # seconds: invariant 3 of gateway/journal
SLACK = 2.0  # for a commit to the disk of a guest whose host is busy
NOT_IN_ORDER = "1B010000"  # SQLITE_NOTICE_RECOVER_WAL: see deploy/OPERATING.md, journal-state
LOGGED = re.compile(r"(\S+)Z warning hall: .*\(#([0-9]+)[;)]")
PLANT = f"""\
schema: 1
gateway: {{name: guest}}
journal: {{file: {JOURNAL}}}
lines:
  - name: hall
    interface: socketcan:vcan0
    bit_rate: 500kbit
    role: observer
    node_id: 127
    nodes: [{{id: {NODE}, name: io, eds: {EDS}/digital-io.eds}}]
"""


def arguments():
    parser = argparse.ArgumentParser()
    parser.add_argument("--linegated", required=True)
    parser.add_argument("--linegate", required=True)
    parser.add_argument("--before", help="the output of the round before, if there was one")
    parser.add_argument("--cuts", type=int, default=0, help="power cuts so far")
    parser.add_argument("--last", action="store_true", help="check only")
    return parser.parse_args()


def events_in(text):
    """Returns the events in an output. The last line may be cut off: such an event does not count."""
    return [json.loads(line) for line in text.splitlines() if line.startswith("{") and line.endswith("}")]


def logged_in(text):
    """Returns [(time, number)] of the events of the line that a log names. It names only some of many."""
    found = [LOGGED.match(line) for line in text.splitlines()]
    return [(datetime.datetime.fromisoformat(match[1]), int(match[2])) for match in found if match]


def stored(linegate):
    status, text = run(linegate, "--json", "history", "--journal", JOURNAL)
    if status != 0:
        raise Failed(f"the journal cannot be read: {status}: {text}")
    return events_in(text)


def key(event):
    return event["stream"], event["line"], event["number"]


def check_journal(linegate, before):
    with open(before, encoding="utf-8") as file:
        output = file.read()
    seen = events_in(output)
    check("events were read before the power was cut", seen)
    events = stored(linegate)
    by_key = {key(event): event for event in events}
    check("no event number was used twice", len(by_key) == len(events))
    lost = [event for event in seen if by_key.get(key(event)) != event]
    if lost:
        raise Failed(f"{len(lost)} events that were stored are missing or changed, the first: {lost[0]}")
    last = {}
    for event in events:
        stream = event["stream"], event["line"]
        if event["number"] <= last.get(stream, 0):
            raise Failed(f"an event number decreased: {event}")
        last[stream] = event["number"]
    check_log(logged_in(output), {event["number"] for event in events if event["line"] == "hall"})
    print(f"{len(events)} events are in the journal, {len(seen)} had been read in the last round", flush=True)


def check_log(logged, numbers):
    check("the log names events", logged)
    missing = [(time, number) for time, number in logged if number not in numbers]
    check("only the newest are missing", all(number > max(numbers) for _, number in missing))
    lost = (logged[-1][0] - missing[0][0]).total_seconds() if missing else 0
    print(f"events of the last {lost:.1f} s of the log are missing", flush=True)
    check(f"not more than {MOST_LOST + SLACK} s are missing", lost <= MOST_LOST + SLACK)


def pass_on(*command):
    """Starts a program whose output is printed line by line. Returns the thread that does so."""
    process = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)

    def copy():
        for line in process.stdout:
            print(line, end="", flush=True)

    thread = threading.Thread(target=copy, daemon=True)
    thread.start()
    return thread


def scenario():
    programs = arguments()
    os.mkdir(DISK)
    subprocess.run(["mount", "-t", "ext4", "/dev/ubda", DISK], check=True)
    if programs.before:
        check_journal(programs.linegate, programs.before)
    if programs.last:
        return
    known = len([event for event in stored(programs.linegate) if event["kind"] == "emcy"]) if programs.before else 0
    pass_on(programs.linegated, write_file("plant.yaml", PLANT))
    Actor("device", "cangen", "vcan0", "-g", "20", "-I", f"{0x80 + NODE:03X}", "-L", "8", "-D", "i")
    eventually("events are stored", lambda: run(programs.linegate, "--json", "history", "--journal", JOURNAL)[1].count(
        '"emcy"') > known + 10)
    if programs.before:
        reports = [event for event in stored(programs.linegate)
                   if event["kind"] == "journal-state" and event["data"] == NOT_IN_ORDER]
        check("each disorderly end is reported", len(reports) == programs.cuts)
    pass_on(programs.linegate, "--json", "history", "--journal", JOURNAL, "--follow").join()
    raise Failed("the reader ended before the power was cut")


play(scenario)
