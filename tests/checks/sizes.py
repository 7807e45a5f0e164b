#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Functions are short: none has more than 70 lines, from its first brace to its last, or from `def`. Files may have
any length: `sizes.py --files` lists the longest ones."""

import ast
import re
import sys

import tree

LIMIT = 70
LONGEST = 20  # number of files in the list

# Text whose braces do not belong to the code: comments, literals, directives. A ' between digits separates them.
NO_CODE = re.compile(
    r"""//[^\n]*
      | /\*.*?\*/
      | R"(?P<mark>[^()\\\s]{0,16})\(.*?\)(?P=mark)"
      | "(?:[^"\\\n]|\\.)*"
      | (?<![0-9A-Za-z_])'(?:[^'\\\n]|\\.)+'
      | ^[ \t]*\#(?:[^\n\\]|\\.)*""",
    re.DOTALL | re.MULTILINE | re.VERBOSE)
PARTS = re.compile(r"[{}();]")
# Prefixes of a declaration that do not depend on its kind.
BEFORE = re.compile(r"\b(?:public|private|protected)\s*:|\[\[.*?\]\]|\balignas\([^()]*\)|\btemplate\s*<[^{}();]*>")
SCOPE = re.compile(r"\s*(?:(?:inline|static|typedef)\s+)*(?:namespace|class|struct|union|extern)\b")
OPERATOR = re.compile(r"\boperator\s*[^\s\w(]+")
NAME = re.compile(r"(operator\s*[^\s(]+|[\w:~]+)\s*\(")


def blank(text):
    """Returns the text with spaces for everything that is not code; line numbers do not change."""
    return NO_CODE.sub(lambda found: re.sub(r"[^\n]", " ", found.group()), text)


def partners(code):
    """Returns the position of the closing brace by that of the opening one."""
    out, opened = {}, []
    for brace in re.finditer(r"[{}]", code):
        if brace.group() == "{":
            opened.append(brace.start())
        elif opened:
            out[opened.pop()] = brace.start()
    return out


def without_parameters(head):
    """Returns the head of a declaration without the contents of its parentheses."""
    while True:
        shorter = re.sub(r"\([^()]*\)", " ", head)
        if shorter == head:
            return head
        head = shorter


def kind_of(head, after):
    """Returns what a brace between `head` and `after` opens: "scope", "function", or "value"."""
    head = BEFORE.sub(" ", head)
    if "(" not in head or after[:1] == ";":  # class A : B<int(int)> {};
        return "scope" if SCOPE.match(head) else "value"
    if "=" in OPERATOR.sub(" ", without_parameters(head)):
        return "value"
    # a_{1} in the initializer list of a constructor is followed by another member, or by the body.
    return "value" if after[:1] in (",", "{") else "function"


def functions_of_cpp(text):
    """Yields (name, first line, lines) of each function with a body; a lambda is part of the function around it."""
    code = blank(text)
    partner = partners(code)
    start, place, depth = 0, 0, 0  # start: position of the declaration at `place`
    while found := PARTS.search(code, place):
        begin, part = found.start(), found.group()
        place = begin + 1
        if part in "()":
            depth += 1 if part == "(" else -1
        elif part in ";}":
            start = place if depth == 0 else start
        elif begin in partner:
            end = partner[begin]
            kind = "value" if depth > 0 else kind_of(code[start:begin], code[end + 1:end + 200].lstrip())
            if kind == "scope":
                start = place
                continue
            place = end + 1
            if kind == "function":
                name = NAME.search(BEFORE.sub(" ", code[start:begin]))
                line = code.count("\n", 0, begin) + 1
                yield name.group(1) if name else "?", line, code.count("\n", begin, end) + 1
                start = place


def functions_of_python(text):
    """Yields the same for a Python file."""
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)):
            yield node.name, node.lineno, node.end_lineno - node.lineno + 1


def check(root):
    for path in tree.files(root, (".h", ".cpp", ".c", ".py")):
        functions = functions_of_python if path.endswith(".py") else functions_of_cpp
        for name, line, lines in functions(tree.read(root, path)):
            if lines > LIMIT:
                yield f"{path}:{line}: {name} has {lines} lines, more than {LIMIT}"


def longest_files(root):
    """Yields the longest files and their lengths."""
    lengths = [(sum(1 for _ in tree.lines(root, path)), path) for path in tree.files(root, tree.SOURCES + (".py",))]
    yield from sorted(lengths, reverse=True)[:LONGEST]


if __name__ == "__main__":
    if "--files" in sys.argv:
        sys.argv.remove("--files")
        for lines, path in longest_files(sys.argv[1] if len(sys.argv) > 1 else "."):
            print(f"{lines:5} {path}")
    else:
        tree.run(check)
