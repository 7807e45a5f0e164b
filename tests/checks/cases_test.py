#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""tests/cases.py detects every way in which a case, or a program with cases, fails: each is demonstrated by a
program."""

import os
import stat
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as ElementTree

CASES = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "cases.py")
# Prints the output of GoogleTest. A case is the code between its two lines, or the word that ends it.
PROGRAM = """#!/usr/bin/python3
import os, sys, time
CASES = {cases!r}
def say(text):
    print(text, end="", flush=True)
if "--gtest_list_tests" in sys.argv:
    print("Running main()\\nS.\\n" + "".join(f"  {{name}}  # GetParam() = 1\\n" for name in CASES), end="")
    sys.exit(0)
wanted = os.environ["GTEST_FILTER"].split(":")
for name, does in CASES.items():
    if "S." + name not in wanted or does == "left out":
        continue
    say(f"[ RUN      ] S.{{name}}\\nprinted by {{name}}")
    if does == "crash":
        os.kill(os.getpid(), 11)
    if does == "hang":
        time.sleep(600)
    say(f"[{{does:>9}} ] S.{{name}}, where GetParam() = 1 (0 ms)\\n")
sys.exit({code})
"""


def ended(folder, cases, code=0):
    """Returns the exit status of cases.py for a program with these cases, and its own results and those of CTest
    with them."""
    program = os.path.join(folder, "program")
    with open(program, "w", encoding="utf-8") as file:
        file.write(PROGRAM.format(cases=cases, code=code))
    os.chmod(program, stat.S_IRWXU)
    results = os.path.join(folder, "cases", "unit.program.xml")
    status = subprocess.run([sys.executable, CASES, "run", results, "2", "unit.", program], capture_output=True,
                            text=True, check=False)
    found = {one.get("name"): one.get("status") for one in ElementTree.parse(results).getroot()}
    of_ctest = os.path.join(folder, "ctest.xml")
    with open(of_ctest, "w", encoding="utf-8") as file:
        seen = "fail" if status.returncode else "run"
        file.write(f'<testsuite><testcase name="unit.program" status="{seen}"/><testcase name="tsan.unit" status="run"/>'
                   "</testsuite>")
    return status.returncode, found, merged(folder), status.stdout


def merged(folder):
    """Returns the numbers of passed and of other tests whose names begin with unit."""
    folders = [os.path.join(folder, name) for name in ("ctest.xml", "merged.xml", "cases")]
    command = [sys.executable, CASES, "merge", *folders[:2], "unit.", folders[2]]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout.split()


def complaints(folder):
    good, bad = {"a": "OK", "b": "OK"}, {"unit.S.a": "run", "unit.S.b": "run"}
    for code, cases, wanted in (
        (0, good, bad),
        (1, {**good, "c": "FAILED"}, {**bad, "unit.S.c": "fail"}),
        (0, {**good, "c": "SKIPPED"}, {**bad, "unit.S.c": "notrun"}),
        (0, {"c": "crash", **good}, {**bad, "unit.S.c": "fail"}),
        (0, {"c": "hang", "d": "crash", **good}, {**bad, "unit.S.c": "fail", "unit.S.d": "fail"}),
        (0, {**good, "c": "left out"}, {**bad, "unit.S.c": "fail"}),
        (23, good, {**bad, "unit.(outside of its cases)": "fail"}),
        (0, {}, {"unit.(no case)": "fail"}),
    ):
        status, found, count, said = ended(folder, cases, code)
        passed = sum(one == "run" for one in wanted.values())
        told = [str(passed), str(len(wanted) - passed)]
        if (status, found, count) != (int(passed != len(wanted)), wanted, told):
            yield f"of {cases}, {code}: {status}, {found}, {count}"
        if "c" in cases and cases["c"] != "left out" and "printed by c" not in said:
            yield f"what a case printed is not told: {said}"
    os.remove(os.path.join(folder, "cases", "unit.program.xml"))
    of_ctest = os.path.join(folder, "ctest.xml")
    with open(of_ctest, "w", encoding="utf-8") as file:
        file.write('<testsuite><testcase name="unit.program" status="fail"/></testsuite>')
    count = merged(folder)
    if count != ["0", "1"]:
        yield f"a test without results of its cases: {count}"
    yield from of_attempts(folder)


def of_attempts(folder):
    """Runs CTest with a test that passes at its second attempt, one that never passes and one that passes at once."""
    with open(os.path.join(folder, "CTestTestfile.cmake"), "w", encoding="utf-8") as file:
        file.write('add_test(second sh -c "test -e seen || { touch seen; exit 1; }")\n'
                   'add_test(never false)\nadd_test(first true)\n')
    of_ctest, output = os.path.join(folder, "ctest.xml"), os.path.join(folder, "ctest.out")
    with open(output, "w", encoding="utf-8") as file:
        subprocess.run(["ctest", "--test-dir", folder, "--repeat", "until-pass:2", "--output-junit", of_ctest],
                       stdout=file, stderr=file, check=False)
    command = [sys.executable, CASES, "attempts", of_ctest, output]
    named = subprocess.run(command, capture_output=True, text=True, check=True).stdout.split()
    if named != ["second"]:
        yield f"passed at the second attempt: {named}"


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as temporary:
        wrong = list(complaints(temporary))
    print("\n".join(wrong), end="\n" if wrong else "")
    sys.exit(1 if wrong else 0)
