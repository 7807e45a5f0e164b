#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Runs each GoogleTest program once instead of once per case, because starting a program can take longer than its tests
(under sanitizers), and adds the cases to the results of CTest.

cases.py run RESULTS.xml PATIENCE PREFIX PROGRAM   runs every case of a program in one process. A case that ends this
    process, or does not end within PATIENCE seconds, has failed; another process then runs the remaining cases. Writes
    RESULTS.xml (JUnit) and prints the output of failing cases. Exits with 0 if all cases passed.
cases.py merge CTEST.xml RESULTS.xml FIRST FOLDER [verbose]   writes the results of CTest whose names begin with FIRST to
    RESULTS.xml, replaces the test NAME by the cases in FOLDER/NAME.xml, and prints the numbers of passed and of other
    tests. A test that failed in CTest is kept if all its cases passed.
cases.py attempts CTEST.xml OUTPUT   prints the names of tests that passed after a failed attempt in the OUTPUT of CTest.
"""

import os
import re
import select
import subprocess
import sys
import time
import xml.etree.ElementTree as ElementTree

END = re.compile(r"\[ +(OK|FAILED|SKIPPED) +\] (.+?)(?:, where .*)? \(\d+ ms\)$")
PASSED, FAILED, SKIPPED = "run", "fail", "notrun"  # the status values of CTest
STATUS = {"OK": PASSED, "FAILED": FAILED, "SKIPPED": SKIPPED}
FAILED_ATTEMPT = re.compile(r"Test +#\d+: (\S+) \.+ *\*\*\*")  # a failed attempt in the output of CTest
MOST_KEPT = 300_000  # characters of the output of one case
NOT_FOR_XML = re.compile("[^\t\n\r -\ud7ff\ue000-\ufffd]")


class Case:
    """The result of a case: its status, its output and its duration in seconds."""

    def __init__(self, name, status, output, seconds):
        self.name, self.status, self.output, self.seconds = name, status, output, seconds


def listed(program):
    """Returns Suite.Name of every case of a program."""
    told = subprocess.run([program, "--gtest_list_tests"], capture_output=True, text=True, timeout=120, check=True)
    names, suite = [], ""
    for line in told.stdout.splitlines():
        word = line.split("#")[0].rstrip()
        if line.startswith("  "):
            names.append(suite + word.strip())
        elif word.endswith("."):
            suite = word
    return names


class Run:
    """One process that runs some cases of a program, until it ends or its time limit expires."""

    def __init__(self, program, names, patience):
        self.cases, self.patience = [], patience
        self.current, self.output, self.began = None, [], time.monotonic()
        filtered = {**os.environ, "GTEST_FILTER": ":".join(names), "GTEST_COLOR": "no"}
        with subprocess.Popen([program], env=filtered, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                              stderr=subprocess.STDOUT, process_group=0) as process:
            in_time = self.read(process.stdout.fileno())
            if not in_time:
                os.killpg(process.pid, 9)
        self.code = process.returncode
        self.was_cut_short = self.current is not None
        if self.was_cut_short:
            why = f"ended its process with {self.code}" if in_time else f"did not end within {patience} s"
            self.ends(FAILED, f"{self.current} {why}\n")

    def read(self, pipe):
        """Reads the output until the process ends; returns False if the time limit expired."""
        rest, got, in_time = b"", b" ", True
        while in_time and got:
            left = self.began + self.patience - time.monotonic()
            in_time = left > 0 and bool(select.select([pipe], [], [], left)[0])
            got = os.read(pipe, 65536) if in_time else b""
            *lines, rest = (rest + got).split(b"\n")
            for line in lines:
                self.line(line.decode(errors="replace"))
        if rest:
            self.line(rest.decode(errors="replace"))
        return in_time

    def line(self, line):
        begun = re.match(r"\[ RUN      \] (.+)$", line)
        if begun and self.current is None:
            self.current, self.output, self.began = begun[1], [], time.monotonic()
        self.output.append(line + "\n")
        ended = END.search(line)
        if ended and ended[2] == self.current:
            self.ends(STATUS[ended[1]])

    def ends(self, status, words=""):
        output = ("".join(self.output) + words)[-MOST_KEPT:]
        self.cases.append(Case(self.current, status, output, time.monotonic() - self.began))
        self.current, self.output, self.began = None, [], time.monotonic()


def run_all(program, patience):
    """Runs every case of the program once."""
    left, cases = listed(program), []
    if not left:
        return [Case("(no case)", FAILED, f"{program} has no test\n", 0)]
    while left:
        run = Run(program, left, patience)
        cases += run.cases
        ran = {case.name for case in run.cases}
        left = [name for name in left if name not in ran]
        if run.was_cut_short:
            continue
        said = "".join(run.output)[-MOST_KEPT:] + f"{program} ended with {run.code}\n"
        if run.code != 0 and all(case.status == PASSED for case in run.cases):
            cases.append(Case("(outside of its cases)", FAILED, said, 0))
        return cases + [Case(name, FAILED, "It was not run.\n", 0) for name in left]
    return cases


def written(cases, prefix):
    """Returns the cases in the format of CTest."""
    suite = ElementTree.Element("testsuite", tests=str(len(cases)))
    for case in cases:
        name = prefix + case.name
        one = ElementTree.SubElement(suite, "testcase", name=name, classname=name, time=f"{case.seconds:.4f}",
                                     status=case.status)
        if case.status == FAILED:
            ElementTree.SubElement(one, "failure", message="Failed")
        elif case.status == SKIPPED:
            ElementTree.SubElement(one, "skipped", message="SKIP_REGULAR_EXPRESSION_MATCHED")
        if case.status != PASSED:
            ElementTree.SubElement(one, "system-out").text = NOT_FOR_XML.sub("?", case.output)
    return ElementTree.ElementTree(suite)


def run(results, patience, prefix, program):
    cases = run_all(program, float(patience))
    os.makedirs(os.path.dirname(results), exist_ok=True)
    written(cases, prefix).write(results, encoding="unicode")
    bad = [case for case in cases if case.status != PASSED]
    for case in bad:
        print(f"{program}: {prefix}{case.name}: {'skipped' if case.status == SKIPPED else 'failed'}\n{case.output}")
    print(f"{len(cases) - len(bad)} of {len(cases)} cases passed", flush=True)
    return 1 if bad else 0


def merge(of_ctest, results, first, folder, verbose=None):
    tree = ElementTree.parse(of_ctest)
    suite, cases = tree.getroot(), []
    for test in suite.findall("testcase"):
        suite.remove(test)
        if not test.get("name").startswith(first):
            continue
        parts = os.path.join(folder, test.get("name") + ".xml")
        inside = list(ElementTree.parse(parts).getroot()) if os.path.exists(parts) else []
        explained = test.get("status") == PASSED or any(one.get("status") != PASSED for one in inside)
        cases += inside if inside and explained else [*inside, test]
    suite.extend(cases)
    count = {status: sum(one.get("status") == status for one in cases) for status in (PASSED, FAILED, SKIPPED)}
    suite.set("tests", str(len(cases)))
    suite.set("failures", str(count[FAILED]))
    suite.set("skipped", str(count[SKIPPED]))
    tree.write(results, encoding="unicode")
    if verbose:
        for one in cases:
            print(f"{one.get('status')}: {one.get('name')} {one.get('time')} s", file=sys.stderr)
    print(count[PASSED], len(cases) - count[PASSED])
    return 0


def attempts(of_ctest, output):
    if not os.path.exists(of_ctest):
        return 0
    passed = {test.get("name") for test in ElementTree.parse(of_ctest).getroot().findall("testcase")
              if test.get("status") == PASSED}
    with open(output, encoding="utf-8", errors="replace") as lines:
        failed = [FAILED_ATTEMPT.search(line) for line in lines]
    for name in dict.fromkeys(found[1] for found in failed if found):
        if name in passed:
            print(name)
    return 0


if __name__ == "__main__":
    sys.exit({"run": run, "merge": merge, "attempts": attempts}[sys.argv[1]](*sys.argv[2:]))
