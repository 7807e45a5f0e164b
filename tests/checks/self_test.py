#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""The checks can fail: each is run on a small tree that violates its rule, and on one that complies."""

import os
import shutil
import tempfile
import unittest

import catalogue
import contract
import formatting
import kinds
import layering
import licences
import manuals
import mutations
import programs
import public_headers
import readmes
import rows
import services
import sizes
import tree
import typed_commands
import units
import words

STYLE = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", ".clang-format")


class TreeCase(unittest.TestCase):
    def setUp(self):
        self.root = tempfile.mkdtemp()
        self.addCleanup(shutil.rmtree, self.root)

    def write(self, path, text):
        full = os.path.join(self.root, path)
        os.makedirs(os.path.dirname(full), exist_ok=True)
        with open(full, "w", encoding="utf-8") as file:
            file.write(text)

    def complaints(self, check, path, text):
        self.write(path, text)
        found = list(check.check(self.root))
        os.remove(os.path.join(self.root, path))
        return found


class Manuals(TreeCase):
    ROOT = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..")
    SCHEMA = """{"$defs": {"duration": {"type": "string"}}, "properties": {"colour": {"anyOf": [
        {"enum": ["red", "green"]}, {"properties": {"hue": {"minimum": 1, "maximum": 9}}}]}}}"""

    def setUp(self):
        super().setUp()
        with open(os.path.join(self.ROOT, "deploy/package/plant_manual.py"), encoding="utf-8") as generator:
            self.write("deploy/package/plant_manual.py", generator.read())
        for path in (*manuals.GUIDES[:2], "deploy/plants/a.yaml", *manuals.PROGRAM_MANUALS):
            self.write(path, "colour: {hue: 1}")
        self.write(manuals.SCHEMA, self.SCHEMA)
        self.write("gateway/config/a.cpp", 'section.find("colour"); from.read<int>("hue", hue);')
        self.write(manuals.CONTRACT, "CMM_Known does nothing.")

    def test_a_key_that_no_guide_has(self):
        self.assertEqual(list(manuals.check(self.root)), [])
        wider = self.SCHEMA.replace('"hue"', '"tint"')
        self.assertIn("the key tint", self.complaints(manuals, manuals.SCHEMA, wider)[0])

    def test_a_key_that_only_the_loader_or_only_the_schema_has(self):
        for read in ('from.find("tint")', 'from.read_number("tint", tint, 1, 9)', 'read_share(from, "tint", tint)',
                     'from.read_choice<Hue>(\n"tint", hue,'):
            self.assertEqual(self.complaints(manuals, "gateway/config/b.cpp", read),
                             [f"gateway/config/b.cpp: {manuals.SCHEMA} has not the key tint"])
        self.assertEqual(self.complaints(manuals, "gateway/config/a.cpp", 'section.find("colour");'),
                         [f"{manuals.SCHEMA}: no file of gateway/config reads the key hue"])

    def test_an_option_and_a_command_that_no_manual_has(self):
        for code in ('add_flag("--loud", loud);', 'add_option("-l,--loud", loud);', 'add_subcommand("shout", "");'):
            self.write("gateway/cli/linegated.cpp", "")
            self.assertEqual(len(self.complaints(manuals, "gateway/cli/linegate.cpp", code)), 1, code)
            self.write("gateway/cli/linegate.cpp", "")

    def test_a_command_whose_word_the_manual_has_but_no_entry(self):
        for source, manual, code in (
            ("linegate.cpp", manuals.PROGRAM_MANUALS[0], 'CLI::App* one =\n  line.app().add_subcommand(\n"re-try", "");'),
            ("linegated.cpp", manuals.PROGRAM_MANUALS[1], 'app.add_subcommand("re-try", "");'),
        ):
            source = f"gateway/cli/{source}"
            for page in ("They re-try.\n", ".B re-try\nagain.\n", ".TP\n.B re-try-all\nAll.\n"):
                self.write(manual, page)
                self.assertIn("no entry", "".join(self.complaints(manuals, source, code)), (source, page))
            self.write(manual, ".TP\n.B re\\-try\nAgain.\n")
            self.assertEqual(self.complaints(manuals, source, code), [])

    def test_a_hidden_command_and_one_of_a_command_need_no_entry(self):
        self.write(manuals.PROGRAM_MANUALS[0], "All names, and list.\n")
        hidden = 'CLI::App* names = line.app().add_subcommand("names", "");\n'
        self.assertEqual(len(self.complaints(manuals, "gateway/cli/a.cpp", hidden)), 1)
        self.assertEqual(self.complaints(manuals, "gateway/cli/a.cpp", hidden + 'names->group("");'), [])
        self.assertEqual(self.complaints(manuals, "gateway/cli/a.cpp", 'od->add_subcommand("list", "");'), [])

    def test_a_function_of_the_ixxat_manager_that_the_contract_does_not_name(self):
        self.assertEqual(self.complaints(manuals, "stack/line/a.h", "// CMM_Known\n"), [])
        self.assertIn("CMM_Other", self.complaints(manuals, "stack/line/a.h", "// CMM_Known, CMM_Other\n")[0])

    def test_what_the_page_leaves_out(self):
        parts = list(manuals.parts(manuals.json.loads(self.SCHEMA)))
        self.assertEqual(sorted(parts), ["1 .. 9", "colour", "green", "hue", "red"])


class Kinds(TreeCase):
    def setUp(self):
        super().setUp()
        self.write(kinds.CONTRACT, "enum CommandKind {\n  COMMAND_READ,  // node, data\n  COMMAND_VERSIONS,\n"
                                   "  COMMAND_BUS_RESET  // of a line, see COMMAND_READ,\n};\n"
                                   "enum EventKind {\n  EVENT_STARTED,\n  EVENT_STOPPED\n};\n")
        self.write(kinds.COMMANDS, self.commands("read = 0"))
        self.write(kinds.EVENTS, "enum class EventKind : std::uint8_t {\n  started,\n  stopped,  // by a command\n};\n")
        self.write("bridges/request/request.h", self.of_gateway(1, "versions") + self.of_gateway(2, "bus-reset"))

    @staticmethod
    def commands(members):
        return f"enum class CommandKind : std::uint8_t {{\n  {members},\n}};\n"

    @staticmethod
    def of_gateway(number, name):
        return (f"static constexpr line::CommandKind kKind{{{number}}};\n"
                f'static constexpr std::string_view kName = "{name}";\n')

    def test_numbers_and_names_are_those_of_the_contract(self):
        self.assertEqual(list(kinds.check(self.root)), [])

    def test_a_command_with_the_number_of_another(self):
        self.assertEqual(self.complaints(kinds, kinds.COMMANDS, self.commands("read = 2")),
                         ["stack/line/requests.h: read has the number 2, COMMAND_READ in idl/linegate.idl has 0"])

    def test_a_command_that_only_the_program_has(self):
        self.assertEqual(self.complaints(kinds, kinds.COMMANDS, self.commands("read = 0,\n  scan = 3")),
                         ["stack/line/requests.h: scan has the number 3, idl/linegate.idl has no COMMAND_SCAN"])

    def test_a_command_that_only_the_contract_has(self):
        self.assertEqual(self.complaints(kinds, "bridges/request/request.h", self.of_gateway(1, "versions")),
                         ["idl/linegate.idl: COMMAND_BUS_RESET has the number 2, and is missing in stack/line/requests.h "
                          "and bridges/request"])

    def test_events_in_another_order(self):
        swapped = "enum class EventKind : std::uint8_t {\n  stopped,\n  started,\n};\n"
        self.assertEqual(len(self.complaints(kinds, kinds.EVENTS, swapped)), 2)


class TypedCommands(TreeCase):
    CPP = ("class Commands {\n public:\n  // COMMAND_BOOT.\n  Answer<std::vector<Result>> boot(int node) const;\n"
           "  // COMMAND_LSS\n  Answer<R> lss_store() const;\n private:\n  Call refused() const;\n};\n")
    IN_C = ("int linegate_line_wait(linegate_client* client, int line, int timeout_ms);\n"
            "int linegate_request_call(linegate_client* client, int line,\n    const int* request, int timeout_ms);\n"
            "/* COMMAND_NMT */\nint linegate_nmt(linegate_client* client, int line, int timeout_ms);\n"
            f"{typed_commands.C_LATER}\n/* COMMAND_BOOT, COMMAND_LSS */\n"
            "int linegate_boot(linegate_client* client, int line, unsigned node,\n    int timeout_ms);\n"
            "int linegate_lss_store(linegate_client* client, int line, int timeout_ms);\n"
            "int linegate_call_boot(linegate_client* client, int call);\n")
    PYTHON = ('class Commands:\n    def _call(self):\n        """None."""\n\n    def boot(self, node: int, *,\n'
              '             timeout: int = 1) -> int:\n        """BOOT."""\n        call(_lib.linegate_boot, node)\n\n'
              '    def lss_store(self) -> int:\n        """LSS, code 0."""\n        call(_lib.linegate_lss_store, 1)\n')
    PYTHON_LINE = 'class Line:\n    def nmt(self) -> int:\n        """NMT: sends."""\n        call(_lib.linegate_nmt, 1)\n'
    SYMBOLS = "LINEGATE_2 {\n  global:\n    linegate_boot;\n    linegate_lss_store;\n    linegate_call_boot;\n} LINEGATE_1;\n"
    BYTES = "## COMMAND_LSS\n| 0 | store |\n## COMMAND_BOOT\n| 0 | another table |\n"

    def setUp(self):
        super().setUp()
        self.write(kinds.CONTRACT, "enum CommandKind {\n  COMMAND_NMT,\n  COMMAND_BOOT,\n  COMMAND_LSS\n};\n")
        self.write(typed_commands.CPP, self.CPP)
        self.write(typed_commands.CPP_LINE, "class Line {\n  // COMMAND_NMT.\n  Call nmt() const;\n  Call request() const;\n};\n")
        self.write(typed_commands.IN_C, self.IN_C)
        self.write(typed_commands.PYTHON, self.PYTHON)
        self.write(typed_commands.PYTHON_LINE, self.PYTHON_LINE)
        self.write(typed_commands.RANGES, '{"boot", "node", 0, 127},\n')
        self.write(typed_commands.SYMBOLS, self.SYMBOLS)
        self.write(typed_commands.BYTES, self.BYTES)

    def changed(self, path, text, before, after):
        self.assertIn(before, text)
        found = self.complaints(typed_commands, path, text.replace(before, after))
        self.write(path, text)
        return found

    def test_all_have_a_typed_form(self):
        self.assertEqual(list(typed_commands.check(self.root)), [])

    def test_one_that_a_language_has_not(self):
        for path, text, name in ((typed_commands.CPP, self.CPP, " boot("), (typed_commands.IN_C, self.IN_C, "linegate_boot("),
                                 (typed_commands.PYTHON, self.PYTHON, "def boot(")):
            found = self.changed(path, text, name, name.replace("boot", "start"))
            self.assertIn(f"{path}: the typed command boot is missing", found)

    def test_a_command_without_a_typed_form(self):
        self.write(kinds.CONTRACT, "enum CommandKind {\n  COMMAND_NMT,\n  COMMAND_BOOT,\n  COMMAND_LSS,\n  COMMAND_NEW\n};\n")
        self.assertEqual(len(list(typed_commands.check(self.root))), 3)

    def test_a_service_without_a_typed_form(self):
        found = self.changed(typed_commands.BYTES, self.BYTES, "| 0 | store |", "| 0 | store |\n| 1 | more |")
        self.assertEqual(len(found), 1)

    def test_a_function_without_its_version(self):
        found = self.changed(typed_commands.SYMBOLS, self.SYMBOLS, "    linegate_call_boot;\n", "")
        self.assertEqual(found, [f"{typed_commands.SYMBOLS}: linegate_call_boot of {typed_commands.IN_C} is not in LINEGATE_2"])

    def test_one_that_python_encodes_itself(self):
        found = self.changed(typed_commands.PYTHON, self.PYTHON, "_lib.linegate_boot, node", "_lib.linegate_request_call, node")
        self.assertEqual(found, [f"{typed_commands.PYTHON}: boot does not call linegate_boot"])
        found = self.changed(typed_commands.PYTHON_LINE, self.PYTHON_LINE, "_lib.linegate_nmt, 1", "request")
        self.assertEqual(found, [f"{typed_commands.PYTHON}: nmt does not call linegate_nmt"])

    def test_a_number_whose_range_has_no_test(self):
        found = self.changed(typed_commands.IN_C, self.IN_C, "unsigned node,", "unsigned node, uint32_t mask,")
        self.assertEqual(found, [f"{typed_commands.RANGES}: no row for mask of linegate_boot"])


class Contract(TreeCase):
    TEXT = ("// A comment with a };\nmodule linegate {\nmodule v1 {\nconst octet FIRST = 1;\n"
            "enum Kind {\n  KIND_A,  // a comment\n  KIND_B\n};\n"
            "@final struct State {\n  @key string<64> gateway;\n  octet kind;  // Kind\n};\n};\n};\n")

    def setUp(self):
        super().setUp()
        self.write(contract.CONTRACT, self.TEXT)
        self.write(contract.FROZEN, "")
        contract.record(self.root)

    def changed(self, before, after):
        self.assertIn(before, self.TEXT)
        return self.complaints(contract, contract.CONTRACT, self.TEXT.replace(before, after))

    def test_the_text_itself_and_what_may_be_added(self):
        self.assertEqual(list(contract.check(self.root)), [])
        for before, after in (("KIND_B", "KIND_B, KIND_C"), ("@final", "@final struct More { octet a; };\n@final"),
                              ("enum", 'const string TOPIC_MORE = "linegate/v1/More";\nenum'), ("// a comment", "// other")):
            self.assertEqual(self.changed(before, after), [], after)

    def test_changes(self):
        for before, after, name in (("= 1", "= 2", "FIRST"), ("KIND_A,", "KIND_0, KIND_A,", "Kind"), ("KIND_A,", "", "Kind"),
                                    ("octet kind;", "octet kind; octet more;", "State"), ("string<64>", "string<65>", "State"),
                                    ("@key ", "", "State"), ("@final", "@mutable", "State"),
                                    ("const octet FIRST = 1;", "", "FIRST")):
            found = self.changed(before, after)
            self.assertEqual(len(found), 1, after)
            self.assertIn(f"{contract.CONTRACT}: {name} ", found[0])

    def test_a_declaration_that_the_check_does_not_know(self):
        self.assertEqual(len(self.changed("enum", "typedef octet Byte;\nenum")), 1)
        self.assertEqual(len(self.changed("module v1", "module v2")), 1)

    def test_a_record_keeps_what_was_added(self):
        self.write(contract.CONTRACT, self.TEXT.replace("KIND_B", "KIND_B, KIND_C"))
        contract.record(self.root)
        self.assertIn("KIND_A, KIND_B, KIND_C", tree.read(self.root, contract.FROZEN))
        self.assertEqual(len(self.changed("@final", "@final")), 1)


class Programs(TreeCase):
    TESTS = "tests/dds/CMakeLists.txt"

    def setUp(self):
        super().setUp()
        self.write(programs.RUN, "  case $1 in\n    programs)\n      printf linegated test_dds\n      ;;\n    all)\n"
                                 "      printf dds_peer\n      ;;\n")
        self.write("tests/bench/CMakeLists.txt", "add_test(NAME b COMMAND $<TARGET_FILE:measure>)\n")

    def test_a_program_that_is_built(self):
        self.assertEqual(self.complaints(programs, self.TESTS, "linegate_test(test_dds TIER dds TIMEOUT 9)\n"
                                         "add_dependencies(test_dds faults)\n"
                                         "add_test(NAME a COMMAND a.py $<TARGET_FILE:linegated> $<TARGET_FILE:faults>)\n"
                                         "linegate_test(test_units TIER unit)\n"), [])

    def test_a_program_that_is_not_built(self):
        self.assertEqual(self.complaints(programs, self.TESTS, "linegate_gateway_test(test_rights TIER dds)\n"
                                         "add_test(NAME a COMMAND $<TARGET_FILE:dds_peer>)\n"),
                         [f"{self.TESTS}: a test of the tier dds runs {name}, which is not in the set programs of tests/run"
                          for name in ("dds_peer", "test_rights")])


class Mutations(TreeCase):
    DIFF = """A line less.
--- a/stack/a.cpp
+++ b/stack/a.cpp
@@ -1,3 +1,2 @@
 one
-two
 three
"""

    def test_a_mutation_of_a_line_that_is_gone(self):
        self.write("stack/a.cpp", "one\ntwo\nthree\n")
        self.assertEqual(self.complaints(mutations, "tests/plant/mutations/a.diff", self.DIFF), [])
        self.write("stack/a.cpp", "one\nthree\n")
        self.assertEqual(len(self.complaints(mutations, "tests/plant/mutations/a.diff", self.DIFF)), 1)


class Layering(TreeCase):
    AGAINST = [
        ("stack/base/a.h", '"stack/can/frame.h"'),  # a later part
        ("stack/can/a.h", '"stack/stranger/a.h"'),  # an unknown part
        ("stack/line/a.h", '"bridges/can/a.h"'),
        ("stack/line/a.h", '"gateway/a.h"'),
        ("stack/line/a.h", '"a.h"'),
        ("stack/line/a.cpp", "<thread>"),
        ("stack/line/a.cpp", "<atomic>"),
        ("stack/line/a.cpp", "<iostream>"),
        ("stack/line/a.cpp", "<fstream>"),
        ("stack/line/a.cpp", "<sys/socket.h>"),
        ("stack/line/a.cpp", "<spdlog/spdlog.h>"),
        ("bridges/can/a.cpp", '"bridges/sim/a.h"'),
        ("bridges/console/a.cpp", '"bridges/dds/a.h"'),
        ("bridges/console/a.cpp", '"idl/linegate.h"'),
        ("bridges/dds/a.cpp", '"gateway/a.h"'),
        ("bridges/dds/a.cpp", "<atomic>"),
        ("bridges/dds/a.cpp", "<thread>"),
        ("bridges/console/a.cpp", "<fastdds/dds/domain/DomainParticipant.hpp>"),
        ("bridges/console/a.cpp", "<linegate.h>"),
        ("gateway/app/a.cpp", "<linegatePubSubTypes.h>"),
        ("bridges/sim/a.cpp", "<linux/can/raw.h>"),
        ("gateway/app/a.cpp", "<fastrtps/types/TypesBase.h>"),
        ("gateway/app/a.cpp", "<atomic>"),
        ("gateway/app/a.cpp", '"tests/plant/world.h"'),
        ("gateway/publish/a.cpp", '"gateway/cli/a.h"'),
        ("gateway/runtime/a.cpp", '"gateway/publish/a.h"'),
        ("gateway/config/a.cpp", '"gateway/exchange/ring.h"'),
        ("gateway/tools/a.cpp", '"gateway/process/a.h"'),
        ("gateway/app/a.cpp", '"gateway/config/a.h"'),  # an unknown part of the gateway
        ("gateway/cli/a.cpp", '"gateway/a.h"'),
        ("gateway/publish/a.cpp", '"bridges/dds/a.h"'),
    ]
    ALONG = [
        ("stack/can/a.h", '"stack/base/time.h"'),
        ("stack/can/a.h", '"stack/can/frame.h"'),
        ("stack/line/a.h", "<vector>"),
        ("bridges/can/a.cpp", "<linux/can.h>"),
        ("bridges/sim/a.cpp", '"bridges/can/a.h"'),
        ("bridges/dds/a.cpp", '"stack/image/snapshot.h"'),
        ("bridges/dds/a.cpp", '"idl/linegate.h"'),
        ("bridges/dds/a.cpp", "<fastdds/dds/domain/DomainParticipant.hpp>"),
        ("bridges/dds/a.cpp", "<linegatePubSubTypes.h>"),
        ("gateway/exchange/a.h", "<atomic>"),
        ("gateway/publish/dds_edge.cpp", '"bridges/dds/a.h"'),
        ("gateway/cli/a.cpp", '"gateway/process/a.h"'),
        ("gateway/publish/a.cpp", '"gateway/runtime/a.h"'),
        ("tests/plant/a.cpp", '"tests/plant/world.h"'),
    ]

    def test_includes_against_the_arrows(self):
        for path, header in self.AGAINST:
            with self.subTest(path=path, header=header):
                found = self.complaints(layering, path, f"#pragma once\n#include {header}\n")
                self.assertEqual(len(found), 1)
                self.assertTrue(found[0].startswith(f"{path}:2: "), found[0])

    def test_includes_along_the_arrows(self):
        for path, header in self.ALONG:
            with self.subTest(path=path, header=header):
                self.assertEqual(self.complaints(layering, path, f"#include {header}\n"), [])

    def test_a_clock_in_the_stack(self):
        text = "auto now = std::chrono::steady_clock::now();\n"
        self.assertEqual(len(self.complaints(layering, "stack/line/a.cpp", text)), 1)
        self.assertEqual(self.complaints(layering, "gateway/app/a.cpp", text), [])


class Catalogue(TreeCase):
    def test_an_index_outside_of_the_catalogue(self):
        for line in ("constexpr std::uint16_t kStore = 0x1010;", "inline constexpr std::uint64_t kStore = 0x5f18;",
                     "  constexpr od::Address kFirst{0xA000, 1};", "number({0x1018, sub});", "set({0x6040, 0}, 6);",
                     "plan({0x1017, 0}, 1);"):
            with self.subTest(line=line):
                found = self.complaints(catalogue, "gateway/a.cpp", line)
                self.assertEqual(len(found), 1)
                self.assertTrue(found[0].startswith("gateway/a.cpp:1: "), found[0])

    def test_the_catalogue_and_other_numbers(self):
        for path, line in (
            (catalogue.CATALOGUE, "inline constexpr std::uint16_t kStoreParameters = 0x1010;"),
            ("tests/stack/a.cpp", "constexpr std::uint16_t kStore = 0x1010;"),
            ("stack/a.cpp", "constexpr std::uint32_t kIdBits = 0x1FFF'FFFF;"),
            ("stack/a.cpp", "constexpr std::uint16_t kControlword = 0x6040;"),
            ("stack/a.cpp", "// {0x1018, 1}"),
            ("stack/a.cpp", "return {od::objects::kIdentity, 1};"),
        ):
            with self.subTest(path=path, line=line):
                self.assertEqual(self.complaints(catalogue, path, line), [])


class PublicHeaders(TreeCase):
    LIST = "set(LINEGATE_PUBLIC_HEADERS\n    can/frame.h\n    base/time.h)\n"
    EXAMPLE = "int main() {}\n"
    GUIDE = f"`a.cpp`:\n\n```cpp\n{EXAMPLE}```\n"

    def setUp(self):
        super().setUp()
        self.write(public_headers.LIST, self.LIST)
        self.write(public_headers.GUIDE, self.GUIDE)
        self.write("deploy/library/a.cpp", self.EXAMPLE)
        self.write("stack/base/time.h", "#include <chrono>\n")
        self.write("stack/can/frame.h", '#include "stack/base/time.h"\n')

    def test_public_headers_of_public_ones(self):
        self.assertEqual(list(public_headers.check(self.root)), [])

    def test_a_private_header_in_a_public_one(self):
        found = self.complaints(public_headers, "stack/base/time.h", '#include "stack/base/secret.h"\n')
        self.assertEqual(len(found), 1)
        self.assertIn("stack/base/secret.h", found[0])

    def test_a_name_of_the_standard_library_without_its_header(self):
        text = '#include "stack/base/time.h"\n'  # which includes <chrono>
        for line, complaint in (
            ("std::chrono::seconds a; // std::vector\n", None),
            ("std::vector<int> a;\n", "frame.h:2: uses vector, but does not include <vector>"),
            ("auto operator<=>(const A&) const = default;\n", "frame.h:2: uses <=>, but does not include <compare>"),
            ("std::flat_map<int> a;\n", "frame.h:2: flat_map has no header"),
        ):
            with self.subTest(line=line):
                self.write("stack/can/frame.h", text + line)
                found = list(public_headers.check(self.root))
                self.assertEqual(len(found), 1 if complaint else 0)
                self.assertTrue(not complaint or complaint in found[0], found)

    def test_a_header_that_does_not_exist(self):
        os.remove(os.path.join(self.root, "stack/can/frame.h"))
        self.assertEqual(len(list(public_headers.check(self.root))), 1)

    def test_no_list(self):
        self.assertIn("no list", self.complaints(public_headers, public_headers.LIST, "")[0])

    def test_an_example_that_differs_from_the_guide(self):
        self.write("deploy/library/a.cpp", "int main() { return 1; }\n")
        self.assertEqual(len(list(public_headers.check(self.root))), 1)
        os.remove(os.path.join(self.root, "deploy/library/a.cpp"))
        self.assertIn("a.cpp, which does not exist", list(public_headers.check(self.root))[0])


class Licences(TreeCase):
    NAMED = "SPDX-License-Identifier: Apache-2.0\n"

    def test_a_source_file_without_one(self):
        for path, text, line in (
            ("stack/a.h", "#pragma once\n", 1),
            ("stack/a.h", f"\n// {self.NAMED}", 1),
            ("stack/a.cpp", f"# {self.NAMED}", 1),
            ("stack/a.cpp", "// SPDX-License-Identifier: MIT\n", 1),
            ("stack/CMakeLists.txt", "", 1),
            ("deploy/demo", "#!/bin/bash\n", 2),
            ("deploy/demo", "#!/bin/bash\n# The demo.\n", 2),
        ):
            with self.subTest(path=path, text=text):
                found = self.complaints(licences, path, text)
                self.assertEqual(len(found), 1)
                self.assertTrue(found[0].startswith(f"{path}:{line}: "), found[0])

    def test_a_file_with_one_and_data_without(self):
        for path, text in (
            ("stack/a.h", f"// {self.NAMED}#pragma once\n"),
            ("idl/a.idl", f"// {self.NAMED}"),
            ("deploy/a.yaml", f"# {self.NAMED}schema: 1\n"),
            ("deploy/demo", f"#!/bin/bash\n# {self.NAMED}"),
            ("tests/fuzz/corpus/a/a.yaml", "schema: 1\n"),
            ("bridges/sim/eds/a.eds", "[FileInfo]\n"),
            ("README.md", "here\n"),
        ):
            with self.subTest(path=path):
                self.assertEqual(self.complaints(licences, path, text), [])


class Readmes(TreeCase):
    def test_a_folder_without_one(self):
        self.write("README.md", "here\n")
        self.assertEqual(self.complaints(readmes, "stack/a.cpp", ""), ["stack: no README.md"])

    def test_an_empty_one(self):
        found = self.complaints(readmes, "README.md", "")
        self.assertEqual(found, [".: an empty README.md"])

    def test_corpus_and_build_need_none(self):
        self.write("README.md", "here\n")
        self.write("corpus/eds/a.eds", "")
        self.assertEqual(self.complaints(readmes, "build/release/a", ""), [])


class Sizes(TreeCase):
    def test_a_function_has_up_to_70_lines(self):
        self.assertEqual(self.complaints(sizes, "a.cpp", "int f() {" + "\n" * 69 + "}\n"), [])
        self.assertEqual(self.complaints(sizes, "a.cpp", "int f() {" + "\n" * 70 + "}\n"),
                         ["a.cpp:1: f has 71 lines, more than 70"])
        self.assertEqual(self.complaints(sizes, "a.py", "def f():" + "\n" * 69 + "    pass\n"), [])
        self.assertEqual(len(self.complaints(sizes, "a.py", "def f():" + "\n" * 70 + "    pass\n")), 1)

    def test_a_file_is_as_long_as_its_subject(self):
        self.assertEqual(self.complaints(sizes, "a.h", "\n" * 5000), [])

    # One function of each kind, and constructs that resemble functions.
    def test_what_is_a_function(self):
        text = """
#define BRACE {
namespace a {
enum class E : int { one, two };
constexpr std::array kTable{1, 2};
constexpr auto kSum = [](int n) { return n; }(1);
std::function<void(int)> call{nullptr};
extern "C" int from_c(int n) { return n; }
struct alignas(64) S final : Base<int(int)> {
 public:
  explicit S(int n, Options options = {}) : a_{n}, b_(n), c_{'{'} { text = R"(})"; }
  S& operator=(const S& other) { return *this; }  // }
  template <class T = int>
  [[nodiscard]] bool operator==(const T& other) const noexcept { return false; }
  void declared(int n = 1'000);
  std::vector<int> a_{1, 2};
};
}  // namespace a
auto a::S::get() const -> int { if (one) { return 1; } return [] { return 2; }(); }
TEST(A, B) {}
"""
        self.assertEqual([name for name, _, _ in sizes.functions_of_cpp(text)],
                         ["from_c", "S", "operator=", "operator==", "a::S::get", "TEST"])


class Services(TreeCase):
    HEAD = "## Services and objects\n\n| service or object | where | test |\n|---|---|---|\n"
    FAULTS = "## When something fails\n\n| what is seen | what happens | what to do | shown by |\n|---|---|---|---|\n"
    FAULT = "| no SYNC | nothing | wait | `Sync.IsSent` |\n"

    def found_in(self, row, faults=FAULTS + FAULT):
        self.write("deploy/OPERATING.md", faults)
        self.write("stack/sync/producer.h", "")
        self.write("tests/stack/CMakeLists.txt", "linegate_test(t SOURCES sync_test.cpp)\n")
        self.write("tests/stack/sync_test.cpp", "TEST_F(Sync, IsSent) {}\n// TEST(Sync, IsLate)\n")
        self.write("tests/stack/left_out_test.cpp", "TEST(Sync, IsNotBuilt) {}\n")
        return self.complaints(services, "stack/README.md", self.HEAD + row)

    def test_all_is_there(self):
        row = "| SYNC | `sync/producer.h` | `Sync.IsSent` `stack/sync_test.cpp` |\n"
        self.assertEqual(self.found_in(row), [])

    def test_a_pattern_of_files(self):
        self.write("tests/sync/CMakeLists.txt", "file(GLOB sync CONFIGURE_DEPENDS *_service_test.cpp)\n")
        self.write("tests/sync/sync_service_test.cpp", "TEST(SyncService, IsBuilt) {}\n")
        self.write("tests/sync/sync_test.cpp", "TEST(SyncService, IsNotBuilt) {}\n")
        self.assertEqual(self.found_in("| SYNC | `sync/producer.h` | `SyncService.IsBuilt` |\n"), [])
        self.assertEqual(len(self.found_in("| SYNC | `sync/producer.h` | `SyncService.IsNotBuilt` |\n")), 1)

    def test_what_is_missing(self):
        for cells in (
            "`sync/producer.h` | `Sync.IsGone`",
            "`sync/producer.h` | `Sync.IsLate`",
            "`sync/producer.h` | `Sync.IsNotBuilt`",
            "`sync/producer.h` | `stack/gone.py`",
            "`sync/gone.h` | `Sync.IsSent`",
            "`sync/producer.h` | none",
            "`sync/producer.h`",
        ):
            with self.subTest(cells=cells):
                found = self.found_in(f"| SYNC | {cells} |\n")
                self.assertEqual(len(found), 1)
                self.assertTrue(found[0].startswith("stack/README.md:5: "), found[0])

    def test_an_empty_table(self):
        self.assertEqual(len(self.found_in("")), 1)

    def test_sentences_of_routing(self):
        row = "| SYNC | `sync/producer.h` | `Sync.IsSent` |\n"
        head = "## Each public sentence, and its test\n\n| sentence | where | test |\n|---|---|---|\n"
        for sentence, count in (
            ("| SYNC is routed | `sync/producer.h` | `Sync.IsSent` |\n", 0),
            ("| SYNC is routed | `sync/producer.h` | `Sync.IsGone` |\n", 1),
            ("| SYNC is routed | `sync/producer.h` | |\n", 1),
            ("", 1),
        ):
            with self.subTest(sentence=sentence):
                self.write("stack/routing/README.md", head + sentence)
                self.assertEqual(len(self.found_in(row)), count)

    def test_what_a_row_says_and_its_tests_do_not(self):
        self.write("stack/base/event.cpp", '{{{"sync-lost", EventSeverity::error}}}')
        events = ("## The log, and what each event says\n\n| event | severity | what it says |\n|---|---|---|\n"
                  "| `sync-lost` | error | no SYNC |\n\n")
        for claim, count in (
            ("SYNC", 0),
            ("SYNC. Differs: not 1006h", 0),
            ("SYNC, 1006h", 1),
            ("SYNC: `sync-lost`", 1),
            ("SYNC: hook `after_sync`", 1),
            ("TIME", 1),
        ):
            with self.subTest(claim=claim):
                row = f"| {claim} | `sync/producer.h` | `Sync.IsSent` |\n"
                self.assertEqual(len(self.found_in(row, events + self.FAULTS + self.FAULT)), count)

    def test_an_event_in_a_test(self):
        for text in ("a sync-lost", "EventKind::sync_lost", "event::SyncLost{10ms}"):
            self.assertTrue(rows.speaks_of_event(text, "sync-lost"), text)
        for text in ("SYNC", "event::SyncLostAgain", "SyncLost"):
            self.assertFalse(rows.speaks_of_event(text, "sync-lost"), text)

    def test_faults(self):
        row = "| SYNC | `sync/producer.h` | `Sync.IsSent` |\n"
        for fault in (
            "| no SYNC | nothing | wait | `Sync.IsGone` |\n",
            "| no SYNC | nothing | wait | none |\n",
            "| no SYNC | nothing | wait | `sync/gone.py` |\n",
            "| no SYNC | nothing | `Sync.IsSent` |\n",
            "| no SYNC |  | wait | `Sync.IsSent` |\n",
        ):
            with self.subTest(fault=fault):
                found = self.found_in(row, self.FAULTS + fault + "\n## Next\n\n| a | b |\n")
                self.assertEqual(len(found), 1)
                self.assertTrue(found[0].startswith("deploy/OPERATING.md:5: "), found[0])
        self.assertEqual(len(self.found_in(row, self.FAULTS)), 1)

    def test_events(self):
        row = "| SYNC | `sync/producer.h` | `Sync.IsSent` |\n"
        events = "## The log, and what each event says\n\n| event | severity | what it says |\n|---|---|---|\n"
        self.write("stack/base/event.cpp", '{{{"sync-lost", EventSeverity::error}, {"emcy", EventSeverity::warning}}}')
        lost, emcy = "| `sync-lost` | error | no SYNC |\n", "| `emcy` | warning | an error |\n"
        for table, count in (
            (lost + emcy, 0),
            (lost, 1),
            (lost + emcy.replace("warning", "info"), 1),
            (lost + emcy + "| `boot-up` | info | a start |\n", 1),
        ):
            with self.subTest(table=table):
                self.assertEqual(len(self.found_in(row, events + table + "\n" + self.FAULTS + self.FAULT)), count)


class Words(TreeCase):
    def test_unfinished(self):
        for text in ("// TODO later", "// enough for now", "GTEST_SKIP();", "TEST(A, DISABLED_b)"):
            with self.subTest(text=text):
                found = self.complaints(words, "a.cpp", f"\n{text}\n")
                self.assertEqual(len(found), 1)
                self.assertTrue(found[0].startswith("a.cpp:2: "))

    def test_finished(self):
        self.assertEqual(self.complaints(words, "a.cpp", "// waits for nowhere\n"), [])


class Formatting(TreeCase):
    def setUp(self):
        super().setUp()
        shutil.copy(STYLE, self.root)

    def test_untidy(self):
        found = self.complaints(formatting, "a.cpp", "int  a ;\n")
        self.assertEqual(len(found), 1)
        self.assertTrue(found[0].startswith("a.cpp:1:"), found[0])

    def test_tidy(self):
        self.assertEqual(self.complaints(formatting, "a.cpp", "int a;\n"), [])


class Units(TreeCase):
    GOOD = "[Service]\nExecStart=/nowhere/at/all\nWatchdogSec=20s\nAmbientCapabilities=CAP_SYS_NICE\n"

    def test_what_systemd_would_ignore(self):
        self.assertEqual(self.complaints(units, "deploy/good.service", self.GOOD), [])
        for bad in (
            self.GOOD.replace("WatchdogSec", "WatchdogSek"),
            self.GOOD.replace("20s", "20lightyears"),
            self.GOOD.replace("CAP_SYS_NICE", "CAP_SYS_NICER"),
            self.GOOD.replace("ExecStart", "ExecStop"),
        ):
            self.assertNotEqual(self.complaints(units, "deploy/bad.service", bad), [], bad)

    def test_a_recording_where_the_service_must_not_write(self):
        self.write(units.GUIDE, "record: /var/lib/a/x.log\nrecord: {file: /var/log/a/b/x.log, files: 2}\nrecord: x.log\n")
        whole = self.GOOD + "StateDirectory=a\nLogsDirectory=b a\n"
        self.assertEqual(self.complaints(units, units.SERVICE, whole), [])
        for bad, line in (("StateDirectory=a", 1), ("LogsDirectory=b a", 2)):
            found = self.complaints(units, units.SERVICE, whole.replace(bad, ""))
            self.assertEqual([complaint.split()[0] for complaint in found], [f"{units.GUIDE}:{line}:"])


if __name__ == "__main__":
    unittest.main()
