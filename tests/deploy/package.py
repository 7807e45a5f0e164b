#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""The Debian packages, made from the build and unpacked: their contents and dependencies are right, systemd accepts the
unit, and programs, samples, manuals and completion work and agree.

package.py BUILD
"""

import os
import re
import subprocess
import sys
import tempfile
import unittest

BUILD = ""
FILES = {
    "etc/default/linegated",
    "etc/linegate/linegate-profiles.xml",
    "usr/bin/linegate",
    "usr/bin/linegated",
    "usr/lib/systemd/system/linegated.service",
    "usr/share/bash-completion/completions/linegate",
    "usr/share/bash-completion/completions/linegated",
    "usr/share/doc/linegate/OPERATING.md",
    "usr/share/doc/linegate/SECURITY.md",
    "usr/share/doc/linegate/copyright",
    "usr/share/linegate/dds/linegate-profiles.xml",
    "usr/share/linegate/dds/loopback-profiles.xml",
    "usr/share/linegate/eds/analog-io.eds",
    "usr/share/linegate/eds/digital-io.eds",
    "usr/share/linegate/eds/drive.eds",
    "usr/share/linegate/eds/encoder.eds",
    "usr/share/linegate/eds/fd-io.eds",
    "usr/share/linegate/idl/COMMANDS.md",
    "usr/share/linegate/idl/README.md",
    "usr/share/linegate/idl/linegate.idl",
    "usr/share/linegate/plant.schema.json",
    "usr/share/linegate/plants/below-a-plc.yaml",
    "usr/share/linegate/plants/demo-fd.yaml",
    "usr/share/linegate/plants/demo.yaml",
    "usr/share/linegate/plants/slave.yaml",
    "usr/share/linegate/plants/vcan.yaml",
    "usr/share/man/man1/linegate.1.gz",
    "usr/share/man/man5/plant.yaml.5.gz",
    "usr/share/man/man8/linegated.8.gz",
}
# Libraries that the programs call directly; these depend on further ones.
NEEDED = {"libc6", "libfastrtps2.9", "libfastcdr1", "libyaml-cpp0.7", "libspdlog1.10-fmt9", "libpugixml1v5",
          "libsystemd0", "libncursesw6", "libsqlite3-0", "libssl3"}
# Packages of the client library: files, and packages that they need.
CLIENT = {
    "liblinegate-client1": (
        {"usr/lib/liblinegate-client.so.1", "usr/lib/liblinegate-client.so.0.1.0"},
        {"libc6", "libfastrtps2.9", "libfastcdr1", "libpugixml1v5", "libssl3"}),
    "liblinegate-client-dev": (
        {"usr/include/linegate/client.h", "usr/include/linegate/commands.h", "usr/include/linegate/linegate.h",
         "usr/lib/liblinegate-client.so", "usr/lib/pkgconfig/linegate-client.pc",
         *(f"usr/lib/cmake/linegate/linegate-{name}.cmake" for name in (
             "config", "config-version", "client-targets", "client-targets-relwithdebinfo"))},
        {"liblinegate-client1 (= 0.1.0)"}),
    "python3-linegate": (
        {f"usr/lib/python3/dist-packages/linegate/{name}" for name in (
            "__init__.py", "_library.py", "commands.py", "py.typed")},
        {"liblinegate-client1 (= 0.1.0)", "python3"}),
}
CONTROL = {"conffiles", "control", "md5sums", "postinst", "prerm", "postrm"}


def run(*command, **options):
    done = subprocess.run(command, capture_output=True, text=True, check=False, **options)
    return done.returncode, done.stdout + done.stderr


def output(*command, **options):
    status, text = run(*command, **options)
    if status != 0:
        raise AssertionError(f"{command} ended with {status}: {text}")
    return text


class Package(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(cls.folder.cleanup)
        where = cls.folder.name
        os.chmod(where, 0o755)  # other users run its programs, too
        output("cpack", "-G", "DEB", "-B", where, cwd=BUILD)
        cls.packages = {name.split("_")[0]: os.path.join(where, name) for name in os.listdir(where)
                        if name.endswith(".deb")}
        package = os.path.basename(cls.packages["linegate"])
        cls.package = os.path.join(where, package)
        cls.root = os.path.join(where, "root")
        cls.control = os.path.join(where, "control")
        output("dpkg-deb", "--extract", cls.package, cls.root)
        output("dpkg-deb", "--control", cls.package, cls.control)

    def path(self, name):
        return os.path.join(self.root, name)

    def help(self, *command):
        return output(self.path("usr/bin/" + command[0]), *command[1:], "--help")

    def field(self, name):
        return output("dpkg-deb", "--field", self.package, name).strip()

    def test_holds_what_a_system_needs_and_nothing_else(self):
        found = {os.path.relpath(os.path.join(folder, name), self.root)
                 for folder, _, names in os.walk(self.root) for name in names}
        self.assertEqual(found, FILES)
        self.assertEqual(set(os.listdir(self.control)), CONTROL)
        owners = {line.split()[1] for line in output("dpkg-deb", "--contents", self.package).splitlines()}
        self.assertEqual(owners, {"root/root"})

    def test_depends_on_the_libraries_it_calls(self):
        depends = {re.split(r"[ :(]", part.strip())[0] for part in self.field("Depends").split(",")}
        self.assertEqual(NEEDED - depends, set())
        self.assertIn("adduser", depends)
        self.assertEqual({name for name in depends if name.endswith("-dev")}, set())

    def test_the_client_library_has_packages_of_its_own(self):
        self.assertEqual(set(self.packages), {"linegate", *CLIENT})
        root = os.path.join(self.folder.name, "client")
        for name, (files, needed) in CLIENT.items():
            package = self.packages[name]
            output("dpkg-deb", "--extract", package, root)
            listed = [line.split()[5] for line in output("dpkg-deb", "--contents", package).splitlines()]
            found = {path[2:] for path in listed if not path.endswith("/")}
            self.assertEqual(found, files | {f"usr/share/doc/{name}/copyright"})
            depends = output("dpkg-deb", "--field", package, "Depends").strip()
            self.assertEqual(needed - set(re.split(r", ", re.sub(r" \(>=[^)]*\)", "", depends))), set())
        summaries = [output("dpkg-deb", "--field", package, "Description").splitlines() for package in self.packages.values()]
        self.assertEqual(len({lines[0] for lines in summaries}), len(summaries))
        self.assertEqual([lines[0] for lines in summaries if len(lines) < 2], [])
        self.assertEqual(output("dpkg-deb", "--field", self.packages["python3-linegate"], "Architecture"), "all\n")
        self.assertIn("liblinegate-client 1 liblinegate-client1", output(
            "dpkg-deb", "--info", self.packages["liblinegate-client1"], "shlibs"))
        script = "import linegate\nprint(linegate.version())"
        self.assertEqual(output("/usr/bin/python3", "-B", "-c", script, env={
            **os.environ, "PYTHONPATH": os.path.join(root, "usr/lib/python3/dist-packages"),
            "LD_LIBRARY_PATH": os.path.join(root, "usr/lib")}), self.field("Version") + "\n")

    def test_keeps_what_the_operator_changed(self):
        with open(os.path.join(self.control, "conffiles"), encoding="utf-8") as file:
            listed = {line.strip().lstrip("/") for line in file}
        self.assertEqual(listed, {name for name in FILES if name.startswith("etc/")})

    def test_maintainer_scripts_are_sound_and_executable(self):
        for name in ("postinst", "prerm", "postrm"):
            script = os.path.join(self.control, name)
            output("sh", "-n", script)
            self.assertTrue(os.access(script, os.X_OK), name)

    def test_systemd_accepts_the_unit_where_it_is_installed(self):
        # The units of this host stand for those of the system that the package is installed into.
        units = self.path("usr/lib/systemd/system")
        for name in os.listdir("/usr/lib/systemd/system"):
            if not os.path.lexists(os.path.join(units, name)) and name != "linegated.service":
                os.symlink(os.path.join("/usr/lib/systemd/system", name), os.path.join(units, name))
        with open(os.path.join(units, "linegated.service"), encoding="utf-8") as file:
            unit = file.read()
        programs = re.findall(r"^Exec\w+=(/usr/\S+)", unit, re.MULTILINE)
        self.assertEqual(programs, ["/usr/bin/linegated"])
        for program in programs:
            unit = unit.replace(program, self.root + program)
        copy = os.path.join(self.folder.name, "linegated.service")
        with open(copy, "w", encoding="utf-8") as file:
            file.write(unit)
        status, text = run("systemd-analyze", "verify", "--man=no", copy)
        self.assertEqual((status, [line for line in text.splitlines() if "linegated" in line]), (0, []))

    def test_programs_run_as_anybody(self):
        anybody = {"user": "nobody", "cwd": "/"} if os.geteuid() == 0 else {}
        self.assertIn(self.field("Version"), output(self.path("usr/bin/linegated"), "--version", **anybody))
        for plant in ("demo", "demo-fd", "vcan"):
            output(self.path("usr/bin/linegate"), "check", self.path(f"usr/share/linegate/plants/{plant}.yaml"),
                   **anybody)

    def manual(self, name):
        packed = self.path(f"usr/share/man/man{name[-1]}/{name}.gz")
        return output("gzip", "-cd", packed).replace("\\-", "-")

    def test_manuals_name_every_command_and_option(self):
        for program, page in (("linegated", "linegated.8"), ("linegate", "linegate.1")):
            text, told = self.manual(page), self.help(program)
            for option in re.findall(r"--[a-z-]+", told):
                self.assertIn(option, text, page)
            for command in re.findall(r"^  ([\w-]+) ", told.partition("Subcommands:")[2], re.MULTILINE):
                self.assertIn(f"\n.B {command}\n", text, page)
        self.assertIn("\n.B lock_memory\n", self.manual("plant.yaml.5"))

    def complete(self, *words):
        script = self.path("usr/share/bash-completion/completions/linegate")
        line = " ".join(f"'{word}'" for word in words)
        text = output("bash", "-c", f"source {script}; COMP_WORDS=({line}); COMP_CWORD={len(words) - 1}; _linegate;"
                      'printf "%s\\n" "${COMPREPLY[@]}"')
        return set(text.split())

    def test_completes_commands_and_options(self):
        linegate = self.path("usr/bin/linegate")
        commands = set(re.findall(r"^  ([\w-]+) ", self.help("linegate").partition("Subcommands:")[2], re.MULTILINE))
        self.assertEqual(self.complete(linegate, ""), commands)
        self.assertEqual(self.complete(linegate, "--json", "sdo", ""), {"read", "write"})
        self.assertEqual(self.complete(linegate, "eve"), {"events"})
        self.assertIn("--concise", self.complete(linegate, "dcf", "--"))
        self.assertIn("--last-words", self.complete(self.path("usr/bin/linegated"), "--"))


if __name__ == "__main__":
    BUILD = sys.argv.pop(1)
    unittest.main()
