#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""`linegate monitor` on a pseudo-terminal, with a running gateway: its pages, keys and sizes; the terminal is
restored however the program ends; and its output where there is no terminal.

monitor.py LINEGATED LINEGATE PROFILES
"""

import fcntl
import os
import re
import select
import signal
import struct
import subprocess
import termios
import time

from plant_process import Console, EDS, Failure, PATIENCE, own_domain, run_test, write

PLANT = """schema: 1
gateway: {{name: monitored}}
dds: {{domain: {domain}, profile: {profiles}}}
lines:
  - name: press
    interface: "simulated:"
    network_id: 1
    heartbeat: 1s
    nodes: [{{id: 8, name: panel, eds: {eds}, heartbeat: 500ms}}]
    simulate: [{{node: 8, profile: digital-io}}]
  - name: hall
    interface: "simulated:"
    network_id: 2
    heartbeat: 1s
    nodes: [{{id: 12, name: doors, eds: {eds}, heartbeat: 500ms}}]
    simulate: [{{node: 12, profile: digital-io}}]
"""
# The capabilities of a minimal terminal, so that this program can interpret all output.
TERMINAL = r"""lgtest|a terminal for tests,
  cols#80, lines#24,
  clear=\E[H\E[J, cup=\E[%i%p1%d;%p2%dH, ed=\E[J, el=\E[K, cr=\r, ind=\n, cud1=\n, cub1=\b,
  smcup=\E[?1049h, rmcup=\E[?1049l, rev=\E[7m, bold=\E[1m, sgr0=\E[m,
  kcud1=\E[B, kcuu1=\E[A,
"""
SEQUENCE = re.compile(r"\x1b\[(\??)([0-9;]*)([A-Za-z])")


class Terminal:
    """The master side of a pty: the contents of the screen, and what remains at the end."""

    def __init__(self, command, environment, rows=24, columns=80):
        self.master, self.slave = os.openpty()
        self.set_size(self.master, rows, columns)
        self.modes = termios.tcgetattr(self.slave)
        self.process = subprocess.Popen(command, env=environment, stdin=self.slave, stdout=self.slave,
                                        stderr=self.slave, start_new_session=True,
                                        preexec_fn=lambda: fcntl.ioctl(0, termios.TIOCSCTTY, 0))
        self.ended = os.pidfd_open(self.process.pid)
        self.rows, self.columns = rows, columns
        self.cells = [[" "] * columns for _ in range(rows)]
        self.row = self.column = 0
        self.alternate = False
        self.pending = ""
        self.seen = b""

    @staticmethod
    def set_size(descriptor, rows, columns):
        fcntl.ioctl(descriptor, termios.TIOCSWINSZ, struct.pack("HHHH", rows, columns, 0, 0))

    def resize(self, rows, columns):
        self.rows, self.columns = rows, columns
        self.cells = [[" "] * columns for _ in range(rows)]
        self.set_size(self.master, rows, columns)

    def type(self, text):
        os.write(self.master, text.encode())

    def line(self, number):
        return "".join(self.cells[number]).rstrip()

    def text(self):
        return "\n".join(self.line(number) for number in range(self.rows))

    def read(self, seconds):
        """Processes the next output. Returns False when the program has ended and no output is left."""
        ready = select.select([self.master, self.ended], [], [], max(seconds, 0))[0]
        if self.master not in ready:
            return not ready
        news = os.read(self.master, 65536)
        self.seen += news
        self.pending += news.decode("ascii", "replace")
        self.process_pending()
        return True

    def process_pending(self):
        while self.pending:
            if self.pending[0] == "\x1b":
                found = SEQUENCE.match(self.pending)
                if found is None:
                    if len(self.pending) > 20:
                        raise Failure(f"not understood: {self.pending[:20]!r}")
                    return  # incomplete: the rest follows
                self.obey(*found.groups())
                self.pending = self.pending[found.end():]
            else:
                self.put(self.pending[0])
                self.pending = self.pending[1:]

    def obey(self, private, arguments, kind):
        numbers = [int(number or 0) for number in arguments.split(";")]
        if private:
            if numbers == [1049]:
                self.alternate = kind == "h"
        elif kind == "H":
            self.row, self.column = (max(number, 1) - 1 for number in (numbers + [1])[:2])
        elif kind in "JK":
            self.erase(self.row, self.column)
            for row in range(self.row + 1, self.rows if kind == "J" else 0):
                self.erase(row, 0)
        elif kind != "m":
            raise Failure(f"a sequence that the terminal does not have: {kind}")

    def erase(self, row, column):
        if row < self.rows:
            self.cells[row][column:] = [" "] * (self.columns - column)

    def put(self, character):
        if character == "\r":
            self.column = 0
        elif character == "\n":
            self.row = min(self.row + 1, self.rows - 1)
        elif character == "\b":
            self.column = max(self.column - 1, 0)
        elif character >= " ":
            if self.row < self.rows and self.column < self.columns:
                self.cells[self.row][self.column] = character
            self.column = min(self.column + 1, self.columns - 1)

    def until(self, what, condition):
        end = time.monotonic() + PATIENCE
        while not condition():
            if time.monotonic() > end or not self.read(end - time.monotonic()):
                raise Failure(f"not seen: {what}; but\n{self.text()}")

    def shows(self, *texts):
        self.until(" and ".join(texts), lambda: all(text in self.text() for text in texts))

    def end(self, how):
        """The program ends with status 0, and restores the terminal."""
        end = time.monotonic() + PATIENCE
        while self.read(end - time.monotonic()):
            if time.monotonic() > end:
                self.process.kill()
                raise Failure(f"{how}: it does not end")
        check(f"{how}: the exit status is {self.process.wait()}", self.process.wait() == 0)
        check(f"{how}: the screen is given back", not self.alternate)
        check(f"{how}: the modes of the terminal are as before", termios.tcgetattr(self.slave) == self.modes)
        for descriptor in (self.master, self.slave, self.ended):
            os.close(descriptor)


class Bench(Console):
    def __init__(self, linegated, linegate, profiles, folder):
        domain = own_domain()
        super().__init__(linegate, profiles, domain,
                         {**os.environ, "TERMINFO": folder, "TERM": "lgtest", "LC_ALL": "C"})
        subprocess.run(["tic", "-x", "-o", folder, write(os.path.join(folder, "lgtest.ti"), TERMINAL)], check=True)
        plant = write(os.path.join(folder, "plant.yaml"),
                      PLANT.format(domain=domain, profiles=profiles, eds=os.path.join(EDS, "digital-io.eds")))
        self.gateway = subprocess.Popen([linegated, plant], stderr=subprocess.DEVNULL)

    def monitor(self, *options, **environment):
        return Terminal([*self.console, "monitor", *options], {**self.environment, **environment})

    def close(self):
        self.gateway.kill()
        self.gateway.wait()


def check(what, truth):
    if not truth:
        raise Failure(what)


def pages_keys_and_sizes(bench):
    screen = bench.monitor()
    screen.shows("press", "hall", "2 lines, 2 of 2 nodes operational", "error-active", "q quit")
    check("it draws on a screen of its own", screen.alternate)
    screen.type("3")
    screen.shows("OBJECT", "panel.Read", "UNSIGNED8", "6000:01")
    screen.type("/node=12\r")
    screen.until("only node 12", lambda: "only node=12" in screen.text() and "panel" not in screen.text())
    screen.type("\x1b")
    screen.shows("panel.Read")
    screen.type("2")
    screen.shows("PRESENCE", "doors")
    screen.type("\x1b[B")
    screen.until("the cursor at the second row", lambda: screen.line(4).startswith(">press"))
    screen.type("\r")
    screen.shows("node 8 of press (gateway monitored): panel", "operational, present", "booted", "values")
    screen.resize(40, 120)
    screen.until("the last of 40 rows", lambda: screen.line(39).startswith(" q quit"))
    screen.until("the right end of 120 columns", lambda: screen.line(0).endswith("UTC") and len(screen.line(0)) == 119)
    screen.resize(10, 50)
    screen.until("the last of 10 rows", lambda: screen.line(9).startswith(" q quit"))
    screen.type("?")
    screen.until("the keys", lambda: screen.line(2).startswith(" keys"))
    screen.type("q")
    screen.end("q")


def a_node_by_its_name(bench):
    screen = bench.monitor("--node", "panel")
    screen.type("3")
    screen.until("the values of panel", lambda: "panel.Read" in screen.text() and "only line=press node=8" in
                 screen.text())
    screen.type("q")
    screen.end("q")


def what_has_no_screen_gets_text(bench):
    plain = bench.text("monitor")
    for wanted in ("--- lines at ", "--- nodes\n", "--- values\n", "--- the newest events\n", "panel.Read input 8-bit"):
        check(f"{wanted!r} in {plain}", wanted in plain)
    only = bench.text("monitor", "--once", "--line", "hall", "--node", "12")
    check(f"one line alone: {only}", "doors" in only and "panel" not in only)
    for words in (("--line", "press", "--node", "panel"), ("--node", "panel")):
        named = bench.text("monitor", "--once", *words)
        check(f"one node by its name, {words}: {named}", "panel.Read input 8-bit" in named and "doors" not in named)
    unknown = bench.monitor(TERM="no-such-terminal")
    unknown.end("an unknown terminal")
    check("an unknown terminal gets text", b"--- values" in unknown.seen and b"\x1b" not in unknown.seen)


def json_is_one_document_or_a_stream(bench):
    end = time.monotonic() + PATIENCE
    while True:
        whole = bench.json("monitor", "--once")
        entry = whole["lines"][1]["inputs"]["entries"][0]
        if entry["valid"] or time.monotonic() > end:
            break
    check("the lines", [line["line"] for line in whole["lines"]] == ["hall", "press"])
    check(f"a value is a number: {entry}", isinstance(entry["value"], int) and entry["type"] == "UNSIGNED8")
    check("the events", "line-started" in [event["kind"] for event in whole["events"]])
    kinds = {document["type"] for document in bench.stream("monitor", "--duration", "1s")}
    check(f"a stream of all: {kinds}", kinds == {"lines", "image", "event"})


def a_gateway_that_leaves_and_signals(bench):
    interrupted, terminated = bench.monitor(), bench.monitor()
    for screen in (interrupted, terminated):
        screen.shows("2 of 2 nodes operational")
    bench.gateway.terminate()
    check("the gateway stops in good order", bench.gateway.wait(timeout=PATIENCE) == 0)
    for screen in (interrupted, terminated):
        screen.shows("gateway gone", "2 not heard")
    interrupted.type("\x03")
    interrupted.end("Ctrl-C")
    terminated.process.send_signal(signal.SIGTERM)
    terminated.end("SIGTERM")


def test(folder, linegated, linegate, profiles):
    bench = Bench(linegated, linegate, profiles, folder)
    try:
        pages_keys_and_sizes(bench)
        a_node_by_its_name(bench)
        what_has_no_screen_gets_text(bench)
        json_is_one_document_or_a_stream(bench)
        a_gateway_that_leaves_and_signals(bench)
    finally:
        bench.close()


if __name__ == "__main__":
    run_test(test)
