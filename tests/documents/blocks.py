# SPDX-License-Identifier: Apache-2.0
"""The fenced blocks of a Markdown document, their commands, and what it says that they print."""

import re

NOT_RUN = re.compile(r"<!-- not run(?: \((?P<only>[^)]*)\))?: (?P<reason>.*?) -->", re.DOTALL)
FENCE = re.compile(r"^```(\w*)$")
PRINTS = re.compile(r"#.*?\bprints: (.*)$")
ENDS_WITH = re.compile(r"#.*?\bends with (\d+)\b")
INLINE = re.compile(r"`((?:linegated?|idlc|fastddsgen)\s[^`]*)`")
MOMENT = re.compile(r"\d{4}-\d\d-\d\d[ T]\d\d:\d\d:\d\d\.\d+|\b\d\d:\d\d:\d\d\.\d+")


class Block:
    """A fenced block: its language, text, first line, heading, and the comment above it that says what is not run."""

    def __init__(self, document, heading, language, number, mark):
        self.document, self.heading, self.language, self.number = document, heading, language, number
        self.reason = mark["reason"].replace("\n", " ") if mark else None
        self.left_out = [start.strip() for start in (mark["only"] or "").split(",") if start.strip()] if mark else []
        self.lines = []

    @property
    def place(self):
        return f"{self.document}:{self.number}"

    @property
    def text(self):
        return "\n".join(self.lines) + "\n"

    def is_run(self):
        """False when all of it is marked as not run."""
        return self.reason is None or bool(self.left_out)


class Command:
    """A command of a block, with what the document says of its output and its exit status."""

    def __init__(self, block, text, output=None):
        self.block, self.text, self.output = block, text, output
        prints = PRINTS.search(text)
        if prints and output is None:
            self.output = [prints[1]]
        status = ENDS_WITH.search(text)
        self.status = int(status[1]) if status else 0

    def left_out(self):
        """The beginning by which the mark of the block leaves this command out, or None."""
        return next((start for start in self.block.left_out if self.text.startswith(start)), None)


class Inline:
    """A command in the running text of a document."""

    def __init__(self, document, number, text):
        self.place, self.text = f"{document}:{number}", text


def outside(text):
    """(number, line) of what is in no fenced block."""
    inside = False
    for number, line in enumerate(text.splitlines(), start=1):
        if line.startswith("```"):
            inside = not inside
        elif not inside:
            yield number, line


def inline(document, text):
    """The commands in the running text, each once, and the reasons for those that are not run, by command."""
    found, numbers, prose = {}, [], ""
    for number, line in outside(text):
        numbers += [number] * (len(line) + 1)
        prose += line + "\n"
    marks = {}
    for mark in NOT_RUN.finditer(prose):
        for command in (mark["only"] or "").split(","):
            marks[command.strip()] = " ".join(mark["reason"].split())
    for span in INLINE.finditer(prose):
        command = " ".join(span[1].split())
        found.setdefault(command, Inline(document, numbers[span.start()], command))
    return list(found.values()), marks


def blocks(document, text):
    """The fenced blocks of a document, in their order."""
    found, heading, block, mark = [], "", None, ""
    for number, line in enumerate(text.splitlines(), start=1):
        fence = FENCE.match(line)
        if block is not None:
            if line == "```":
                found.append(block)
                block, mark = None, ""
            else:
                block.lines.append(line)
        elif fence:
            block = Block(document, heading, fence[1], number, NOT_RUN.search(mark))
        elif line.startswith("#"):
            heading, mark = line.lstrip("# "), ""
        elif line.startswith("<!--") or (mark and "-->" not in mark):
            mark += line + "\n"
        elif line:
            mark = ""
    return found


def commands(block):
    """The commands of a block of language sh (a line each) or console (`$ command`, and below it what it prints)."""
    if block.language == "sh":
        return [Command(block, line) for line in block.lines if line and not line.startswith("#")]
    found = []
    for line in block.lines:
        if line.startswith("$ "):
            found.append(Command(block, line[2:], []))
        elif found:
            found[-1].output.append(line)
    return found


def pattern(line):
    """What a printed line has to match: `...` is anything, times are of the same form, runs of blanks are one."""
    parts = []
    for part in re.split(r"(\.\.\.|\s+)", MOMENT.sub("@MOMENT@", line.strip())):
        parts.append({"...": ".*"}.get(part, r"\s+" if part.isspace() else re.escape(part)))
    return re.compile("".join(parts).replace("@MOMENT@", f"(?:{MOMENT.pattern})") + r"\s*")


def difference(wanted, printed):
    """What is printed otherwise than the document says, or None. A line `...` is any number of lines."""
    rest = [line.strip() for line in printed]
    skip = False
    for line in wanted:
        if line.strip() == "...":
            skip = True
            continue
        rule = pattern(line)
        while skip and rest and not rule.fullmatch(rest[0]):
            rest.pop(0)
        if not rest:
            return f"not printed: {line}"
        if not rule.fullmatch(rest[0]):
            return f"printed: {rest[0]}\n  not:     {line}"
        rest.pop(0)
        skip = False
    return f"printed, too: {rest[0]}" if rest and not skip else None
