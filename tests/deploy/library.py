#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""The stack as a library, installed from the build: it has the public headers and no others, another project finds
its package, and the examples of deploy/library print the output shown in the guide.

library.py BUILD CXX
"""

import os
import re
import subprocess
import sys
import tempfile
import unittest

BUILD = ""
CXX = ""
EXAMPLES = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "deploy", "library")


def output(*command):
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise AssertionError(f"{command} ended with {done.returncode}: {done.stdout}{done.stderr}")
    return done.stdout


class Library(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(cls.folder.cleanup)
        cls.prefix = os.path.join(cls.folder.name, "prefix")
        output("cmake", "--install", BUILD, "--component", "stack", "--prefix", cls.prefix)
        cls.include = os.path.join(cls.prefix, "include", "linegate")

    def configure(self, name, source, *options):
        build = os.path.join(self.folder.name, name)
        return build, ("cmake", "-S", source, "-B", build, f"-DCMAKE_CXX_COMPILER={CXX}",
                       f"-DCMAKE_PREFIX_PATH={self.prefix}", *options)

    def test_public_headers_are_installed_and_private_ones_are_not(self):
        headers = {os.path.relpath(os.path.join(folder, name), self.include)
                   for folder, _, names in os.walk(self.include) for name in names}
        self.assertIn("stack/line/line.h", headers)
        self.assertIn("stack/node/node.h", headers)
        self.assertNotIn("stack/node/impl.h", headers)
        self.assertNotIn("stack/pdo/engine_impl.h", headers)

    def test_the_examples_print_what_the_guide_says(self):
        build, command = self.configure("examples", EXAMPLES, "-DCMAKE_BUILD_TYPE=Debug")
        output(*command)
        output("cmake", "--build", build)
        with open(os.path.join(EXAMPLES, "README.md"), encoding="utf-8") as guide:
            shown = dict(re.findall(r"^`(\w+)`:\n\n```\n(.*?)^```$", guide.read(), re.MULTILINE | re.DOTALL))
        self.assertEqual(set(shown), {"device", "manager"})
        for name, text in shown.items():
            self.assertEqual(output(os.path.join(build, name)), text, name)

    def test_a_component_that_does_not_exist_is_not_found(self):
        source = os.path.join(self.folder.name, "missing")
        os.mkdir(source)
        with open(os.path.join(source, "CMakeLists.txt"), "w", encoding="utf-8") as file:
            file.write("cmake_minimum_required(VERSION 3.25)\nproject(missing LANGUAGES NONE)\n"
                       "find_package(linegate COMPONENTS gateway)\n"
                       "if(linegate_FOUND)\n  message(FATAL_ERROR found)\nendif()\n")
        output(*self.configure("missing-build", source)[1])


if __name__ == "__main__":
    BUILD, CXX = sys.argv[1:3]
    unittest.main(argv=sys.argv[:1])
