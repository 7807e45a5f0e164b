#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""The commands of linegate that work on files, and its messages for wrong arguments, without a gateway.

files.py LINEGATED LINEGATE PROFILES
"""

import json
import os
import shlex
import subprocess

import plant_process
from plant_process import PATIENCE, Failure, expect, run_test, stop, write

BUS = "udp:239.74.163.9:43122"
PLANT = """schema: 1
lines:
  - name: press
    interface: "{uri}"
    simulate: [{{node: 5, profile: drive}}, {{node: 8, profile: digital-io}}]
"""


def run(*words, **options):
    return subprocess.run(words, capture_output=True, text=True, timeout=PATIENCE, check=False, **options)


def the_command_that_check_names_works(folder, linegate):
    path = write(f"{folder}/simulate.yaml", PLANT.format(uri=BUS))
    said = run(linegate, "check", path).stderr
    command = said.partition("run the command: ")[2].strip()
    words = shlex.split(command.splitlines()[0])
    expect("the command", words[:2], ["linegate", "simulate"])
    with subprocess.Popen([linegate, *words[1:]], stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                          text=True) as process:
        said = ""
        while "drive with node-ID 5 on" not in said or "digital-io with node-ID 8 on" not in said:
            line = process.stdout.readline()
            if not line:
                raise Failure(f"{command} ended with:\n{said}")
            said += line
        expect("its exit status", stop(process), 0)


def a_pipe_is_decoded_line_by_line(linegate):
    with subprocess.Popen([linegate, "decode", "-"], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                          text=True) as process:
        for number, state in enumerate(("05", "7F")):
            process.stdin.write(f"({1700000000 + number}.000000) can0 705#{state}\n")
            process.stdin.flush()
            explained = process.stdout.readline()
            if number == 0:  # preceded by the date
                explained = process.stdout.readline()
            expect("the output while the pipe is open", f" {state} " in explained, True)
        process.stdin.close()
        expect("the exit status of decode", process.wait(timeout=PATIENCE), 0)


def wrong_words_are_named(linegate):
    for words, text in ((("frob",), "there is no command 'frob'; linegate --help lists them"),
                        (("sdo", "reed", "press:5", "1000"), "there is no command 'sdo reed'; did you mean 'sdo read'?"),
                        (("config", "x"), "there is no command 'config x'; linegate config --help lists them")):
        done = run(linegate, "--json", *words)
        expect(f"the exit status of {words}", done.returncode, 2)
        expect(f"what {words} gets", json.loads(done.stdout), {"ok": False, "domain": "usage", "text": text})
        expect("the same in words", done.stderr, text + "\n")


def wrong_usage_is_an_object(folder, linegate):
    missing = f"{folder}/missing.log"
    for words in (("simulate",), ("simulate", "virtual:x", "--device", "none"), ("decode", missing), ("replay", missing,
                  "virtual:x"), ("eds", missing, "press"), ("sdo", "read", "x", "1000", "0"), ("sdo", "read"),
                  ("nmt", "start", "press"), ("sdo", "write", "press:5", "1017:00", "u16", "x"),
                  ("sdo", "write", "press:5", "1021", "d", "00FF"), ("sdo", "write", "press:5", "2005", "b", "1"),
                  ("record", "none:x"), ("emcy", "press", "zz"), ("history", "--csv"), ("history", "--journal", missing,
                  "--severity", "bad"), ("history", "--journal", missing, "--since", "2026-02-30"), ("--timeout", "nan", "lines"),
                  ("--timeout", "1e10", "lines"), ("--timeout", "0", "lines"), ("--wait", "-1", "lines"), ("--wait", "inf", "lines"),
                  ("write", "press", "x", "1", "--hold", "nan"), ("monitor", "--duration", "1e10min")):
        done = run(linegate, "--json", "--wait", "0.1", *words)
        expect(f"the exit status of {words}", done.returncode, 2)
        told = json.loads(done.stdout)
        expect(f"the domain of {words}", (told["ok"], told["domain"]), (False, "usage"))
        if not told["text"]:
            raise Failure(f"{words} says nothing")


def what_no_gateway_answers_is_an_object(linegate):
    for words in (("lines",), ("nodes", "press"), ("image", "press"), ("sdo", "read", "press:5", "1000"),
                  ("sdo", "read", "press:all", "1000"), ("sdo", "write", "press:all", "1017", "u16", "500"),
                  ("nmt", "start", "press:all"), ("write", "press", "drive1.Controlword", "6"), ("boot", "press:5"),
                  ("emcy", "press")):
        done = run(linegate, "--json", "--wait", "0.1", *words)
        expect(f"the exit status of {words}", done.returncode, 1)
        told = json.loads(done.stdout)
        expect(f"the domain of {words}", (told["ok"], told["domain"]), (False, "console"))
        expect(f"the text of {words}", told["text"] and told["text"] in done.stderr, True)


def what_cannot_be_written_or_read_is_an_object(folder, linegate):
    file = f"{folder}/no-such-folder/x.log"
    done = run(linegate, "--json", "record", "virtual:x", "-o", file)
    expect("the exit status of record", done.returncode, 1)
    expect("the JSON of record", json.loads(done.stdout),
           {"ok": False, "domain": "console", "text": f"error: {file}: cannot be written: No such file or directory"})
    done = run(linegate, "--json", "history", "--journal", file)
    expect("the exit status of history", (done.returncode, json.loads(done.stdout)["domain"]), (1, "console"))
    done = run(linegate, "record", "virtual:x", "-o", file)
    expect("the text of record", (done.returncode, done.stdout), (1, ""))
    unreadable = f"{folder}/none.dcf"
    os.symlink("/proc/self/mem", unreadable)  # exists, and cannot be read as a file
    done = run(linegate, "--json", "--wait", "0.1", "config", "import", "press:5", unreadable)
    expect("the exit status of import", done.returncode, 1)
    expect("the domain of import", json.loads(done.stdout)["domain"], "console")


def completed(plant, *words):
    """Returns the completions of bash for the last word, with that plant file."""
    script = os.path.join(plant_process.SOURCES, "deploy", "package", "linegate.bash")
    line = " ".join(f"'{word}'" for word in words)
    text = f"source {script}; COMP_WORDS=({line}); COMP_CWORD={len(words) - 1}; _linegate;"
    done = run("bash", "-c", text + 'printf "%s\\n" "${COMPREPLY[@]}"', env={**os.environ, "LINEGATE_PLANT": plant})
    expect(f"the errors of {words}", done.stderr, "")
    return set(filter(None, done.stdout.split("\n")))


def names_are_for_completion(folder, linegate):
    path = write(f"{folder}/names.yaml", f"""schema: 1
lines:
  - name: press
    interface: "simulated:"
    nodes: [{{id: 5, name: ram, eds: {plant_process.EDS}/drive.eds}}]
  - {{name: hall, interface: "virtual:hall"}}
""")
    done = run(linegate, "names", "--plant", path)
    expect("names of a plant", done.stdout.split(), ["press", "press:own", "press:all", "press:ram", "hall", "hall:own",
                                                     "hall:all"])

    def complete(*words):
        return completed(path, *words)

    expect("lines", complete(linegate, "image", "p"), {"press"})
    expect("lines and nodes", complete(linegate, "emcy", "p"), {"press", "press:own", "press:all", "press:ram"})
    expect("lines and devices", complete(linegate, "eds", path, "ha"), {"hall", "hall:own", "hall:all"})
    expect("nodes of a command without them", complete(linegate, "image", "press", ":", "r"), set())
    expect("a node", complete(linegate, "sdo", "read", "press", ":", "r"), {"ram"})
    expect("nodes", complete(linegate, "sdo", "read", "press", ":"), {"own", "all", "ram"})
    expect("the line of --via", complete(linegate, "sdo", "read", "--via", "ha"), {"hall"})
    lines = complete(linegate, "nodes", "")
    expect("lines behind a command", lines, {"press", "hall"})
    for options in (("--json",), ("-d", "5"), ("--domain", "5"), ("--wait", "1", "--utc"), ("--domain=5", "--json")):
        expect(f"lines behind {options} and a command", complete(linegate, *options, "nodes", ""), lines)
        expect(f"a node behind {options}", complete(linegate, *options, "sdo", "read", "press", ":", "r"), {"ram"})
    expect("commands behind options", complete(linegate, "--json", "-d", "5", "bus"), {"bus-restart"})
    expect("the value of an option is no command", complete(linegate, "-d", ""), set())
    expect("the line of an option behind others", complete(linegate, "--json", "monitor", "--line", "ha"),
           {"hall"})
    expect("a line behind an option of the command", complete(linegate, "events", "-n", "5", "ha"), {"hall"})
    expect("nodes of pdo request", complete(linegate, "pdo", "request", "press", ":", ""), {"own", "all", "ram"})
    expect("lines of pdo request", complete(linegate, "pdo", "request", ""),
           {"press", "press:own", "press:all", "press:ram", "hall", "hall:own", "hall:all"})
    expect("completions for a name that is not a line", complete(linegate, "nmt", "st"), set())
    expect("a node behind a command", complete(linegate, "nmt", "start", "press", ":", "r"), {"ram"})
    write(path, "no plant at all: [")
    expect("a plant that cannot be read", complete(linegate, "image", "p"), set())


def security_prints_objects(folder, linegate):
    def members(pairs):
        expect("members that occur twice", len(dict(pairs)), len(pairs))
        return dict(pairs)

    def said(*words, code=0):
        done = run(linegate, "--json", "security", *words)
        expect(f"the exit status of security {words}", done.returncode, code)
        return json.loads(done.stdout, object_pairs_hook=members)

    plant = f"{folder}/authority"
    expect("init", said("init", plant), {"ok": True, "folder": plant})
    expect("issue", said("issue", plant, "panel", "--role", "operator"),
           {"ok": True, "folder": f"{plant}/panel", "identity": "panel", "role": "operator"})
    expect("check", said("check", f"{plant}/panel"),
           {"ok": True, "identity": "panel", "role": "operator", "warnings": []})
    said("issue", plant, "desk", "--role", "viewer")
    certificate = f"{plant}/desk/identity.crt"
    expect("revoke by certificate", said("revoke", plant, "--certificate", certificate),
           {"ok": True, "certificate": certificate})
    expect("revoke", said("revoke", plant, "panel"), {"ok": True, "identity": "panel"})
    for words in (("init", plant), ("issue", plant, "panel", "--role", "viewer", "--line", "plant/press"),
                  ("revoke", plant), ("revoke", plant, "nobody"), ("check", f"{plant}/nobody"),
                  ("check", f"{plant}/panel")):
        refused = said(*words, code=1)
        expect(f"the members of a failed {words}", (refused["ok"], refused["domain"]), (False, "console"))


def names_from_the_network_are_not_expanded(folder, linegate):
    made = f"{folder}/made-by-a-name"
    hostile = (f"$(touch {made})", f"`touch {made}`", f"$(touch${{IFS}}{made})", f"${{x:=$(touch {made})}}",
               f"x;touch {made}", "$HOME", "*", "a b", "a'b", "a\\b", "\x1b[2J")
    names = write(f"{folder}/names.txt", "\n".join((*hostile, "press", "press:ram", "hall-7/press")) + "\n")
    program = write(f"{folder}/linegate-that-got-such-names", f"""#!/bin/bash
if [[ " $* " == *" names "* && $* != *--help* ]]; then exec cat {shlex.quote(names)}; fi
exec {shlex.quote(linegate)} "$@"
""")
    os.chmod(program, 0o755)
    without_plant = f"{folder}/no-plant.yaml"
    expect("names from the network", completed(without_plant, program, "emcy", ""), {"press", "press:ram",
                                                                                      "hall-7/press"})
    expect("those that begin with $", completed(without_plant, program, "sdo", "read", "$"), set())
    expect("a node from the network", completed(without_plant, program, "sdo", "read", "press", ":"), {"ram"})
    expect("whether a name was run as a command", os.path.exists(made), False)


def test(folder, _linegated, linegate, _profiles):
    the_command_that_check_names_works(folder, linegate)
    a_pipe_is_decoded_line_by_line(linegate)
    security_prints_objects(folder, linegate)
    wrong_words_are_named(linegate)
    wrong_usage_is_an_object(folder, linegate)
    what_no_gateway_answers_is_an_object(linegate)
    what_cannot_be_written_or_read_is_an_object(folder, linegate)
    names_are_for_completion(folder, linegate)
    names_from_the_network_are_not_expanded(folder, linegate)


if __name__ == "__main__":
    run_test(test, own_network=True)
