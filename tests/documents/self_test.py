#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""What runs the documents can fail: blocks, marks, commands in running text, and printed lines."""

import os
import sys
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "gateway", "cli"))

from blocks import blocks, commands, difference, inline  # noqa: E402
from fragments import whole  # noqa: E402

DOCUMENT = """# Title
## Start
<!-- not run (ip link): needs
a CAN interface -->
```sh
ip link set can0 up
# a remark
linegate fault press  # prints: lost=2%
linegate boot press:9  # ends with 1
```

```console
$ linegate nodes
NODE  NAME
...
$ linegate boot-up
```

<!-- not run: a picture -->
```
-->
```
"""


class Blocks(unittest.TestCase):
    def setUp(self):
        self.found = blocks("a.md", DOCUMENT)

    def test_languages_headings_and_places(self):
        self.assertEqual([(block.language, block.heading, block.place) for block in self.found],
                         [("sh", "Start", "a.md:5"), ("console", "Start", "a.md:12"), ("", "Start", "a.md:20")])

    def test_marks(self):
        shell, console, picture = self.found
        self.assertEqual((shell.reason, shell.left_out, shell.is_run()), ("needs a CAN interface", ["ip link"], True))
        self.assertEqual((console.reason, console.is_run()), (None, True))
        self.assertEqual((picture.reason, picture.is_run()), ("a picture", False))

    def test_commands(self):
        link, fault, boot = commands(self.found[0])
        self.assertEqual((link.left_out(), fault.left_out()), ("ip link", None))
        self.assertEqual((fault.output, fault.status, boot.output, boot.status), (["lost=2%"], 0, None, 1))
        nodes, boot_up = commands(self.found[1])
        self.assertEqual((nodes.text, nodes.output, boot_up.output), ("linegate nodes", ["NODE  NAME", "..."], []))


class Inline(unittest.TestCase):
    TEXT = """`linegate nodes` and `linegate
nodes` and `linegated --check`, not `linegates`.

<!-- not run (linegate bus-restart LINE,
linegate boot): needs a CAN interface -->
```sh
`linegate in a block`
```
"""

    def test_each_once(self):
        found, marks = inline("a.md", self.TEXT)
        self.assertEqual([(one.text, one.place) for one in found],
                         [("linegate nodes", "a.md:1"), ("linegated --check", "a.md:2")])
        self.assertEqual(marks, {"linegate bus-restart LINE": "needs a CAN interface", "linegate boot": "needs a CAN interface"})


class Whole(unittest.TestCase):
    def test_what_is_whole(self):
        self.assertEqual(whole("", "schema: 1\n"), "schema: 1\n")

    def test_keys_of_a_line(self):
        self.assertIn("    own_values: {1: 2}\n", whole("", "own_values: {1: 2}\n"))
        self.assertEqual(whole("", "nodes:\n  - {id: 5}\n").count("nodes:"), 1)

    def test_lines(self):
        text = whole("Between networks: routes", "routes: []\nlines:\n  - name: press\n    enter: hall\n")
        for part in ("schema: 1", 'interface: "virtual:press"', "- name: hall", "- name: pack"):
            self.assertIn(part, text)


class Difference(unittest.TestCase):
    def test_the_same(self):
        for wanted, printed in (
            ([], []),
            (["a  b (1)"], ["a b   (1) "]),
            (["a ... c"], ["a b c"]),
            (["...", "c"], ["a", "b", "c"]),
            (["a", "..."], ["a", "b"]),
            (["at 2026-11-23 11:15:17.122 ok"], ["at 2027-01-01 00:00:00.000 ok"]),
            (["5 ok 2026-11-23 11:15:17.122   ..."], ["5 ok 2027-01-01 00:00:00.000   4"]),
        ):
            with self.subTest(wanted=wanted, printed=printed):
                self.assertIsNone(difference(wanted, printed))

    def test_another(self):
        for wanted, printed in (
            (["a"], []),
            ([], ["a"]),
            (["a"], ["b"]),
            (["a"], ["a", "b"]),
            (["a.c"], ["abc"]),
            (["...", "c"], ["a", "b"]),
            (["a", "...", "c"], ["b", "c"]),
            (["at 11:15:17.122"], ["at noon"]),
            (["5 ok 2026-11-23 11:15:17.122   0"], ["5 ok 2027-01-01 00:00:00.000   4"]),
        ):
            with self.subTest(wanted=wanted, printed=printed):
                self.assertIsNotNone(difference(wanted, printed))


if __name__ == "__main__":
    unittest.main()
