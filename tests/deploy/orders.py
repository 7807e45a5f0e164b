#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""The two commands of README.md configure the same build folder, in either order. Configures new folders, builds
nothing:

- like deploy/demo on a system without the packages of purpose `tests`: the programs are targets, and omitted targets
are reported; and then like tests/run with these packages: every target that it builds exists;
- like tests/run in a folder that was configured by hand without tests;
- like deploy/demo after tests/run: the folder is used as configured, so its targets exist.
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


def expect(wanted, folder, when):
    missing = wanted - targets(folder)
    assert not missing, f"{when}: no target {', '.join(sorted(missing))}"


def main():
    demo, run = of_demo(), of_run()
    assert demo >= {"linegated", "linegate"} and "fuzz_sdo" in run, (demo, run)
    with tempfile.TemporaryDirectory() as folder:
        first, second = os.path.join(folder, "demo-first"), os.path.join(folder, "by-hand")
        printed = configured(first, *WITHOUT)
        assert "Tests: left out, libgtest-dev is not installed" in printed, printed
        assert "tests/bench: left out, libbenchmark-dev is not installed" in printed, printed
        expect(demo, first, "deploy/demo without the packages of the tests")
        assert "fuzz_sdo" not in targets(first), "tests are configured without GoogleTest"
        configured(first, *WITH)
        expect(run | demo, first, "tests/run after deploy/demo")
        configured(second, "-DLINEGATE_BUILD_TESTS=OFF", "-DLINEGATE_BUILD_BENCH=OFF")
        configured(second)
        expect(run | demo, second, "tests/run in a folder configured without tests")
    return 0


if __name__ == "__main__":
    sys.exit(main())
