#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Runs the commands and fragments of the documents as they stand there, and compares what they print with what the
document says.

documents.py LINEGATED LINEGATE [DOCUMENT]. See README.md beside it.
"""

import os
import re
import shutil
import signal
import sys
import time

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, os.path.join(HERE, "..", "gateway", "cli"))

from plant_process import SOURCES, Failure, run_test  # noqa: E402
from blocks import Command, blocks, commands, difference, inline  # noqa: E402
from fragments import make_files, whole  # noqa: E402
from stage import GUIDE_LOG, GUIDE_PLANT, INTERRUPTED, UNTIL_END_OF_BLOCK, UNTIL_OUTPUT, Process, Stage  # noqa: E402

DOCUMENTS = ("README.md", "deploy/OPERATING.md", "idl/README.md")  # and MANUAL
GUIDES = DOCUMENTS[1:]
# What stands for something else in the running text.
PLACEHOLDERS = {"LINE": "press", "NODE": "8", "FOLDER": "found", "EDS-FILES": "devices", "FILE": "valve7.cdc",
                "NEW.yaml": "plant.yaml", "RUNNING.yaml": "plant.yaml"}
DISTURBS = re.compile(r" (boot|accept|apply|fault|nmt|program|bus-restart|scan) ")
# Frames are lost, the NMT start of a node may be among them. Nothing repeats it.
FAULT = "linegate fault "
MANUAL = "plant.yaml(5)"
COMPILED = "tests/interop/CMakeLists.txt"


def example_of_manual():
    """The example of plant.yaml(5), which is made from the schema, as a block of a document."""
    sys.path.insert(0, os.path.join(SOURCES, "deploy", "package"))
    import plant_manual

    example = re.search(r"^\.SH EXAMPLE\n\.EX\n(.*?)^\.EE$", plant_manual.TAIL, re.MULTILINE | re.DOTALL)
    if example is None:
        raise Failure(f"{MANUAL} has no example")
    return f"# Example\n```yaml\n{example[1]}```\n"


def source(document):
    """The text of a document."""
    if document == MANUAL:
        return example_of_manual()
    with open(os.path.join(SOURCES, document), encoding="utf-8") as file:
        return file.read()


class Reader:
    """Goes through a document, block by block; collects what differs and what is not run."""

    def __init__(self, stage, document):
        self.stage, self.document = stage, document
        self.wrong, self.not_run, self.run = [], [], 0
        self.disturbed = True
        self.text = source(document)
        self.blocks = blocks(document, self.text)

    def read(self):
        for block in self.blocks:
            if not block.is_run():
                self.not_run.append(f"{block.place}: {block.reason}")
                continue
            kind = {"sh": self.shell, "console": self.shell, "yaml": self.fragment, "cpp": self.compiled,
                    "c": self.compiled}.get(block.language)
            if kind is None:
                self.wrong.append(f"{block.place}: neither run nor marked as not run")
                continue
            try:
                kind(block)
            except Failure as failure:
                self.wrong.append(f"{block.place}: {failure}")

    def compiled(self, block):
        """Programs are compiled by tests/interop: the first block of each language in a document."""
        first = next(one for one in self.blocks if one.language == block.language)
        if block is not first or not re.search(rf"foreach\(readme [^)]*{re.escape(self.document)}", source(COMPILED)):
            raise Failure("not compiled by tests/interop")
        self.run += 1

    def fragment(self, block):
        """A configuration: `linegate check` takes it."""
        self.stage.write("fragment.yaml", whole(block.heading, block.text))
        status, output = self.stage.run("build/release/bin/linegate check fragment.yaml")
        if status != 0:
            raise Failure(f"linegate check ends with {status}\n{output}")
        self.run += 1

    def inlines(self, executed):
        """The commands in the running text that no block of the documents has."""
        found, marks = inline(self.document, self.text)
        for one in found:
            if one.text in marks:
                self.not_run.append(f"{one.place}: {one.text}: {marks[one.text]}")
            elif not any(text.startswith(one.text) for text in executed):
                executed.add(one.text)
                self.run += 1
                try:
                    self.inline(one.text)
                except Failure as failure:
                    self.wrong.append(f"{one.place}: {one.text}\n  {failure}")

    def inline(self, text):
        """A command whose name alone is mentioned has help; others are run."""
        words = [":".join(PLACEHOLDERS.get(part, part) for part in word.split(":")) for word in text.split()]
        words = ["/".join(PLACEHOLDERS.get(part, part) for part in word.split("/")) for word in words]
        if words[0] in ("idlc", "fastddsgen"):
            words = ["cd", os.path.join(".", os.path.dirname(self.document)), "&&", *words]
        elif words[0] == "linegated":
            words = ["linegated", "--check", next((word for word in words if word.endswith(".yaml")), "plant.yaml")]
        elif len(words) == 2:
            words.append("--help")
        if self.disturbed and self.document in GUIDES:
            self.stage.await_lines()
        self.execute(Command(None, " ".join(words)), None)
        self.disturbed = DISTURBS.search(text) is not None

    def shell(self, block):
        unused = set(block.left_out)
        self.prepare(block)
        if block.language == "console" and self.stage.background:
            self.stage.await_lines()  # what the commands before it began has come to its end
        running = []
        for command in commands(block):
            start = command.left_out()
            if start is not None:
                unused.discard(start)
                self.not_run.append(f"{block.place}: {command.text}: {block.reason}")
                continue
            self.run += 1
            try:
                self.execute(command, running)
            except Failure as failure:
                self.wrong.append(f"{block.place}: {command.text}\n  {failure}")
        for process in running:
            self.interrupt(process)
        if any(FAULT in command.text for command in commands(block)):
            self.stage.start_nodes()
        if unused:
            raise Failure(f"the mark leaves out what is not there: {', '.join(sorted(unused))}")

    def prepare(self, block):
        """Writes plant.yaml as the document shows it under the same heading."""
        for other in self.blocks:
            if other.heading == block.heading and other.language == "yaml" and other.text.startswith("schema:"):
                self.stage.plant("plant.yaml", other.text)

    def execute(self, command, running):
        text = command.text
        if text.startswith("export "):
            self.compare(Command(None, text + " && command -v linegate linegated", ["...", "..."]))
        elif text.startswith("linegated ") and "--check" not in text:
            if re.search(r"&\s*(#.*)?$", text):
                self.stage.begin(text.rsplit("&", 1)[0])
                self.stage.await_lines()
            else:
                self.stage.gateway(text)
        elif text.startswith(UNTIL_END_OF_BLOCK) or "--hold" in text:
            running.append(Process(self.stage, text))
        elif text.startswith(UNTIL_OUTPUT):
            self.interrupt(Process(self.stage, text))
        else:
            self.compare(command)

    def compare(self, command):
        status, output = self.stage.run(command.text)
        if status != command.status:
            raise Failure(f"ends with {status}, not {command.status}\n{output}")
        if command.output is not None:
            found = difference(command.output, output.splitlines())
            if found:
                raise Failure(found + "\n" + output)

    def interrupt(self, process):
        """Ctrl-C, once the command has printed something."""
        record = re.search(r" -o (\S+)", process.text)
        if process.text.startswith(UNTIL_OUTPUT):
            path = os.path.join(self.stage.folder, record[1]) if record else process.path
            enough = 1000 if record else 1
            self.stage.until("output of " + process.text, lambda: os.path.exists(path) and os.path.getsize(path) >= enough)
        if process.shell.poll() is None:
            process.signal(signal.SIGINT)
        if process.wait() not in INTERRUPTED:
            raise Failure(f"ends with {process.shell.returncode} after Ctrl-C: {process.text}\n{process.output()}")


def test(folder, linegated, linegate, *documents):
    wrong = []
    executed = {command.text for document in DOCUMENTS for block in blocks(document, source(document))
                for command in commands(block)}
    if os.path.dirname(linegated) != os.path.dirname(linegate):
        raise Failure("the programs are in two folders")
    for document in documents or DOCUMENTS:
        begin = time.monotonic()
        stage = Stage(os.path.join(folder, document.replace("/", "-")), os.path.dirname(linegated))
        make_files(stage.folder)
        reader = Reader(stage, document)
        try:
            if document in GUIDES:
                stage.plant("plant.yaml", GUIDE_PLANT)
                stage.write("press.log", GUIDE_LOG)
                shutil.copytree(os.path.join(stage.folder, "devices"), os.path.join(stage.folder, "etc/linegate/devices"))
                stage.gateway("linegated plant.yaml")
            reader.read()
            reader.inlines(executed)
            stage.end()
        except Failure as failure:
            reader.wrong.append(f"{document}: {failure}")
        finally:
            stage.kill()
        print(f"{document}: {reader.run} commands and fragments run in {time.monotonic() - begin:.0f} s,",
              f"{len(reader.not_run)} not run")
        print("".join(f"  not run: {one}\n" for one in reader.not_run), end="")
        wrong += reader.wrong
    if wrong:
        raise Failure("\n".join(wrong) + f"\n{len(wrong)} places differ from what is documented")


if __name__ == "__main__":
    run_test(test, own_network=True)
