#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Short functions: none has more than 70 lines, from its first brace to its last, or from `def`. A file is as long as
its subject: `sizes.py --files` lists the longest ones."""

import ast
import re
import sys

import tree

LIMIT = 70
LONGEST = 20  # files of the list

# What may hold braces that are none of the code's: comments, literals, directives. A ' between digits separates them.
NO_CODE = re.compile(
    r"""//[^\n]*
      | /\*.*?\*/
      | R"(?P<mark>[^()\\\s]{0,16})\(.*?\)(?P=mark)"
      | "(?:[^"\\\n]|\\.)*"
      | (?<![0-9A-Za-z_])'(?:[^'\\\n]|\\.)+'
      | ^[ \t]*\#(?:[^\n\\]|\\.)*""",
    re.DOTALL | re.MULTILINE | re.VERBOSE)
PARTS = re.compile(r"[{}();]")
# What stands before a declaration and says nothing of its kind.
BEFORE = re.compile(r"\b(?:public|private|protected)\s*:|\[\[.*?\]\]|\balignas\([^()]*\)|\btemplate\s*<[^{}();]*>")
SCOPE = re.compile(r"\s*(?:(?:inline|static|typedef)\s+)*(?:namespace|class|struct|union|extern)\b")
OPERATOR = re.compile(r"\boperator\s*[^\s\w(]+")
NAME = re.compile(r"(operator\s*[^\s(]+|[\w:~]+)\s*\(")


def blank(text):
    """The text with spaces for all that is no code; lines stay where they are."""
    return NO_CODE.sub(lambda found: re.sub(r"[^\n]", " ", found.group()), text)


def partners(code):
    """The place of the closing brace by that of the opening one."""
    out, opened = {}, []
    for brace in re.finditer(r"[{}]", code):
        if brace.group() == "{":
            opened.append(brace.start())
        elif opened:
            out[opened.pop()] = brace.start()
    return out


def without_parameters(head):
    """The head of a declaration without what is in its parentheses."""
    while True:
        shorter = re.sub(r"\([^()]*\)", " ", head)
        if shorter == head:
            return head
        head = shorter


def kind_of(head, after):
    """What a brace between `head` and `after` begins: "scope", "function", or "value"."""
    head = BEFORE.sub(" ", head)
    if "(" not in head or after[:1] == ";":  # class A : B<int(int)> {};
        return "scope" if SCOPE.match(head) else "value"
    if "=" in OPERATOR.sub(" ", without_parameters(head)):
        return "value"
    # a_{1} in the list of a constructor is followed by another one, or by the body.
    return "value" if after[:1] in (",", "{") else "function"


def functions_of_cpp(text):
    """Yields (name, first line, lines) of each function that has a body; lambdas are part of the one around them."""
    code = blank(text)
    partner = partners(code)
    start, place, depth = 0, 0, 0  # start: of the declaration at `place`
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
    """The same of a Python file."""
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
