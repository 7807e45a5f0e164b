#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""The client library, installed from the build: it exports the API and nothing else, CMake and pkg-config find it, the
examples build and are as short as promised, and the Python module has the structs and numbers of linegate.h.

client_library.py BUILD
"""

import os
import re
import subprocess
import sys
import tempfile
import unittest

from installed_client import EXAMPLES, Installed, output

BUILD = ""
LINES = {"hold.cpp": 40, "hold.c": 50, "hold.py": 25}  # of the examples, at most
CLASSES = "Answer<.*>|Call|Client|Commands|EventReader|Group|Line|Snapshot|Value"
STRUCTS = ("Options", "Value", "Image", "Setting", "Event", "Request", "Object", "LssAddress", "JournalQuery", "Delivery",
           "ScannedNode", "ObjectValue", "Configuration", "Difference", "ProgramFault", "LssResult", "LssAssignment",
           "Connection", "JournalPage", "HistoryValue", "BootResult", "Result")
ENUMS = {"LineStatus": ("LINEGATE_STATUS_", ""), "GroupState": ("LINEGATE_GROUP_", ""),
         "Quality": ("LINEGATE_", "linegate_quality"), "Outcome": ("LINEGATE_", "linegate_outcome")}


class ClientLibrary(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.installed = Installed(BUILD, folder.name)
        with open(os.path.join(cls.installed.include, "linegate", "linegate.h"), encoding="utf-8") as file:
            cls.header = file.read()
        cls.functions = set(re.findall(r"^\w[\w* ]*?(linegate_\w+)\(", cls.header, re.MULTILINE))

    def path(self, *names):
        return os.path.join(self.installed.folder, *names)

    def compile(self, name, text, *options):
        source = self.path(name)
        with open(source, "w", encoding="utf-8") as file:
            file.write(text)
        program = self.path(name.replace(".", "_"))
        output("cc" if name.endswith(".c") else "c++", source, "-o", program, *options)
        return program

    def test_exports_the_api_and_nothing_else(self):
        found, others = set(), []
        for line in output("nm", "-D", "-C", "--defined-only", "--with-symbol-versions",
                           self.installed.so_file).splitlines():
            _, kind, symbol = line.split(" ", 2)
            name, _, version = symbol.rpartition("@@")
            if re.fullmatch(r"linegate_\w+", name) and re.fullmatch(r"LINEGATE_[12]", version):
                found.add(name)
            elif kind != "A" and not (version == "LINEGATE_CXX_0.1" and
                                      re.match(rf"linegate::client::(({CLASSES})::|describe\()", name)):
                others.append(line)
        self.assertEqual(others, [])
        self.assertEqual(found, self.functions)
        self.assertIn("[liblinegate-client.so.1]", output("readelf", "-d", self.installed.so_file))

    def test_examples_build_and_are_short(self):
        self.installed.examples()
        with open(os.path.join(EXAMPLES, "..", "..", "README.md"), encoding="utf-8") as file:
            readme = file.read()
        for name, most in LINES.items():
            with open(os.path.join(EXAMPLES, name), encoding="utf-8") as file:
                lines = file.readlines()
            self.assertLessEqual(len(lines), most, name)
            text = "".join(line for line in lines if not line.startswith("#!") and "SPDX" not in line)
            self.assertIn(f"\n{text}```\n", readme, f"README.md does not show {name} as it is")

    def test_headers_need_nothing_else_and_pkg_config_names_the_library(self):
        flags = output("pkg-config", "--cflags", "--libs", "linegate-client", env={
            **os.environ, "PKG_CONFIG_PATH": os.path.join(os.path.dirname(self.installed.so_file), "pkgconfig")}).split()
        in_c = self.compile("alone.c", "#include <linegate/linegate.h>\nint main(void) {\n"
                            "  return linegate_poll(0, 0) == LINEGATE_ERROR_ARGUMENT ? 0 : 1;\n}\n",
                            "-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Werror", *flags)
        in_cpp = self.compile("alone.cpp", "#include <linegate/client.h>\n#include <linegate/linegate.h>\nint main() {\n"
                              "  return linegate::client::Line().status() == linegate::client::LineStatus::lost ? 0 : 1;\n"
                              "}\n", "-std=c++20", "-Wall", "-Wextra", "-Wpedantic", "-Werror", *flags)
        for program in (in_c, in_cpp):
            output(program, env=self.installed.environment)

    def test_a_project_in_c_alone_finds_the_package(self):
        source = self.path("c-alone")
        os.mkdir(source)
        with open(os.path.join(source, "CMakeLists.txt"), "w", encoding="utf-8") as file:
            file.write("cmake_minimum_required(VERSION 3.25)\nproject(c_alone LANGUAGES C)\n"
                       f"find_package(linegate REQUIRED COMPONENTS client)\nadd_executable(hold {EXAMPLES}/hold.c)\n"
                       "target_link_libraries(hold PRIVATE linegate::client)\n"
                       "if(TARGET linegate::stack)\n  message(FATAL_ERROR stack)\nendif()\n")
        output("cmake", "-S", source, "-B", self.path("c-alone-build"), f"-DCMAKE_PREFIX_PATH={self.installed.prefix}")
        output("cmake", "--build", self.path("c-alone-build"))

    def python(self, text):
        return output("/usr/bin/python3", "-c", text, env={**self.installed.environment,
                                                           "LINEGATE_CLIENT_LIBRARY": self.installed.so_file})

    def test_python_has_the_structs_of_the_header(self):
        self.assertTrue(os.path.exists(os.path.join(self.installed.python, "linegate", "py.typed")))
        told = self.python("from linegate import _library as c\nimport ctypes\n"
                           f"for name in {STRUCTS}:\n  of = getattr(c, name)\n"
                           "  print(name, ctypes.sizeof(of))\n"
                           "  for field in of._fields_: print(field[0], getattr(of, field[0]).offset)\n"
                           "print(*sorted(c.FUNCTIONS))\n").splitlines()
        text = "#include <linegate/linegate.h>\n#include <stdio.h>\nint main(void) {\n"
        struct = None
        for line in told[:-1]:
            word = line.split()[0]
            if word in STRUCTS:
                struct = "linegate" + re.sub("([A-Z])", r"_\1", word).lower()
                text += f'  printf("{word} %zu\\n", sizeof({struct}));\n'
            else:
                text += f'  printf("{word} %zu\\n", offsetof({struct}, {word}));\n'
        program = self.compile("structs.c", text + "}\n", f"-I{self.installed.include}")
        self.assertEqual(output(program).splitlines(), told[:-1])
        self.assertEqual(set(told[-1].split()) - self.functions, set())

    def test_python_has_the_numbers_of_the_header(self):
        for name, (prefix, enum) in ENUMS.items():
            told = dict(line.split() for line in self.python(
                f"import linegate\nfor one in linegate.{name}: print(one.name, int(one))").splitlines())
            body = re.search(r"typedef enum linegate_\w+ \{([^}]*" + prefix + r"[^}]*)\} " + (enum or r"linegate_\w+") + ";",
                             self.header)
            wanted = [word[len(prefix):] for word in re.findall(r"^ +(LINEGATE_\w+)", body[1], re.MULTILINE)]
            self.assertEqual(told, {word: str(number) for number, word in enumerate(wanted)}, name)

    def test_python_refuses_what_cannot_be(self):
        done = subprocess.run(["/usr/bin/python3", "-c", "import linegate\nlinegate.Client(domain=233)"], text=True,
                              env={**self.installed.environment}, capture_output=True, check=False)
        self.assertIn("linegate.Error: domain is above 232", done.stderr)


if __name__ == "__main__":
    BUILD = sys.argv.pop(1)
    unittest.main()
