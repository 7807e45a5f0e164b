# SPDX-License-Identifier: Apache-2.0
"""Compares a row of a table of services with the tests that it names.

A test covers a row only if its text mentions the row's subject. So each object of the dictionary, each kind of event
and each hook that a row names before its differences must occur in one of its tests, and at least one test must have
a word of the row in its name, its comment or its body. A test that is a separate file is the whole file; an object
may also occur in a fixture or constant of the file."""

import os
import re

import tree

TEST = re.compile(r"^(?:TYPED_)?TEST(?:_[FP])?\(\s*(\w+)\s*,\s*(\w+)\s*\)", re.MULTILINE)
OBJECT = re.compile(r"(?<!\.\.)\b([1-9A-F][0-9A-F]{3})h\b")
RANGE = re.compile(r"(\b[0-9A-F]{4}h)(?:\.\.|\s(?:to|up to)\s)\s*[0-9A-F]{4}h")
FUNCTION = re.compile(r"`(?:\w+::)*([a-z]+(?:_[a-z]+)+)`")
CODE = re.compile(r"`([^`]*)`")
DIFFERS = re.compile(r"\b(?:[Dd]iffers|Here)\b")
WORD = re.compile(r"[A-Za-z]{3,}")
COMMON = {"and", "are", "for", "from", "has", "here", "into", "its", "not", "that", "the", "there", "they", "this", "what",
          "where", "with", "manual"}


class Tests:
    """The text of each test, by its name in a table."""

    def __init__(self, root):
        self.root, self.texts, self.files = root, {}, {}
        for path in tree.files(root, (".cpp",)):
            if path.startswith("tests" + os.sep):
                self.add(tree.read(root, path))

    def add(self, text):
        for test in TEST.finditer(text):
            above = text[:test.start()].rstrip("\n").split("\n")
            end = text.find("\n}\n", test.start())
            begin = len(above)
            while begin > 0 and above[begin - 1].startswith("//"):
                begin -= 1
            name = f"{test[1]}.{test[2]}"
            self.texts[name] = "\n".join(above[begin:]) + text[test.start():end if end >= 0 else len(text)]
            self.files[name] = text

    def text(self, name):
        """Returns the test with its comment and its name."""
        return f"{name}\n{self.file(name) if '/' in name else self.texts.get(name, '')}"

    def file(self, name):
        """Returns the whole file with the test."""
        path = os.path.join("tests", name)
        if "/" in name and os.path.isfile(os.path.join(self.root, path)):
            return tree.read(self.root, path)
        return self.files.get(name, "")


def says(text, term):
    """Whether a text mentions an object, in the notation of C++, scenarios or prose."""
    split = f"{term[:2]}'?{term[2:]}"
    return re.search(rf"0x{split}|\b{term}h|\b{term}:|\b{term}\b", text, re.IGNORECASE) is not None


def speaks_of_event(text, kind):
    """Whether a text has a kind of event: in words, as EventKind::sync_lost or as event::SyncLost."""
    struct = "event::" + "".join(part.capitalize() for part in kind.split("-"))
    return kind in text or kind.replace("-", "_") in text or re.search(rf"\b{struct}\b", text) is not None


def stems(text):
    """Returns the words of a text, reduced to the part that plural and tense leave unchanged."""
    return {word.lower()[:5] for word in WORD.findall(re.sub(r"(?<!\bCi)(?<=[a-z])(?=[A-Z])", " ", text))} - COMMON


def unsaid(row, names, tests, kinds):
    """Returns the terms of a row that none of its tests mentions."""
    claim = DIFFERS.split(row)[0]
    texts, files = [tests.text(name) for name in names], [tests.file(name) for name in names]
    for term in dict.fromkeys(OBJECT.findall(RANGE.sub(r"\1", claim))):
        if not any(says(text, term) for text in texts + files):
            yield f"no test of the row speaks of {term}h"
    for kind in CODE.findall(claim):
        if kind in kinds and not any(speaks_of_event(text, kind) for text in texts):
            yield f"no test of the row speaks of the event {kind}"
    for function in FUNCTION.findall(claim):
        if not any(function in text for text in texts + files):
            yield f"no test of the row speaks of {function}"
    if not any(stems(row) & stems(text) for text in texts):
        yield "no test of the row has a word of it: name the row in the comment of a test"
