#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""The two commands of README.md configure the same build folder, in either order. Configures new folders, builds
nothing:

- like deploy/demo on a system without the packages of purpose `tests`: the programs are targets, and omitted targets
are reported; and then like tests/run with these packages: every target that it builds exists;
- like tests/run in a folder that was configured by hand without tests;
- like deploy/demo after tests/run: the folder is used as configured, so its targets exist;
- `cpack` after deploy/demo: all files that the packages contain are built by the demo's targets.
"""

import os
import re
import subprocess
import sys
import tempfile

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
HIDDEN = ["GTest", "benchmark", "CycloneDDS"]  # the CMake packages of purpose `tests`
WITHOUT = [f"-DCMAKE_DISABLE_FIND_PACKAGE_{package}=ON" for package in HIDDEN]
WITH = [f"-DCMAKE_DISABLE_FIND_PACKAGE_{package}=OFF" for package in HIDDEN]


def configured(folder, *options):
    """Returns the output of CMake for the preset `release` in this folder."""
    done = subprocess.run(["cmake", "--preset", "release", "-B", folder, *options], cwd=ROOT, stdin=subprocess.DEVNULL,
                          stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stdout
    return done.stdout


def targets(folder):
    listed = subprocess.run(["ninja", "-C", folder, "-t", "targets", "all"], capture_output=True, text=True, timeout=60,
                            check=True)
    return {line.rsplit(":", 1)[0] for line in listed.stdout.splitlines()}


def of_demo():
    """Returns the targets that deploy/demo builds, as named there."""
    with open(os.path.join(ROOT, "deploy", "demo"), encoding="utf-8") as script:
        return set(re.search(r"--target ([a-z_ ]+?) \|\|", script.read())[1].split())


def of_run():
    """Returns the targets that tests/run builds of the preset `release` and of parts of it, from its own function."""
    with open(os.path.join(ROOT, "tests", "run"), encoding="utf-8") as script:
        text = script.read()
    functions = text[text.index("targets_of() {"):text.index("export CCACHE_BASEDIR")]
    functions += "for set in release programs quick; do targets_of $set; done"
    listed = subprocess.run(["bash", "-c", functions], cwd=ROOT, capture_output=True, text=True, timeout=60, check=True)
    return set(listed.stdout.split())


def packed(folder):
    """Returns the files of the build that `cpack` packs, relative to the folder."""
    with open(os.path.join(folder, "CPackConfig.cmake"), encoding="utf-8") as file:
        components = re.search(r'CPACK_COMPONENTS_ALL "([^"]*)"', file.read())[1].split(";")
    out = set()
    for place, _, names in os.walk(folder):
        if "cmake_install.cmake" in names:
            with open(os.path.join(place, "cmake_install.cmake"), encoding="utf-8") as file:
                parts = re.split(r'^if\(CMAKE_INSTALL_COMPONENT STREQUAL "(\w+)"', file.read(), flags=re.MULTILINE)
            for component, text in zip(parts[1::2], parts[2::2]):
                if component in components:
                    out.update(os.path.relpath(path, folder) for path in re.findall(rf'"({folder}/[^"]+)"', text))
    return out


def is_built(path, commands):
    """Whether one of the commands names the file; a manual page is named before it is compressed."""
    name = os.path.basename(path)[:-len(".gz")] if path.endswith(".gz") else path
    return re.search(rf"(?<!\S){re.escape(name)}(?!\S)", commands) is not None


def expect_packages(demo, folder):
    """Fails if cpack needs a file that has a rule in the build, but is not built by the demo."""
    wanted = packed(folder) & targets(folder)
    assert {"bin/linegated", "deploy/package/linegate.1.gz"} <= wanted, wanted
    commands = subprocess.run(["ninja", "-C", folder, "-t", "commands", *demo], capture_output=True, text=True,
                              timeout=60, check=True).stdout
    missing = sorted(path for path in wanted if not is_built(path, commands))
    assert not missing, f"cpack after deploy/demo: {', '.join(missing)} is not built"


def expect(wanted, folder, when):
    missing = wanted - targets(folder)
    assert not missing, f"{when}: no target {', '.join(sorted(missing))}"


def main():
    demo, run = of_demo(), of_run()
    assert demo == {"linegate_packaged"} and "fuzz_sdo" in run, (demo, run)
    with tempfile.TemporaryDirectory() as folder:
        first, second = os.path.join(folder, "demo-first"), os.path.join(folder, "by-hand")
        printed = configured(first, *WITHOUT)
        assert "Tests: left out, libgtest-dev is not installed" in printed, printed
        assert "tests/bench: left out, libbenchmark-dev is not installed" in printed, printed
        expect(demo | {"linegated", "linegate"}, first, "deploy/demo without the packages of the tests")
        expect_packages(demo, first)
        assert "fuzz_sdo" not in targets(first), "tests are configured without GoogleTest"
        configured(first, *WITH)
        expect(run | demo, first, "tests/run after deploy/demo")
        configured(second, "-DLINEGATE_BUILD_TESTS=OFF", "-DLINEGATE_BUILD_BENCH=OFF")
        configured(second)
        expect(run | demo, second, "tests/run in a folder configured without tests")
    return 0


if __name__ == "__main__":
    sys.exit(main())
