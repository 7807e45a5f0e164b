#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""systemd accepts every unit file of the tree without complaint, and supports the capabilities it names: it silently
ignores those that it does not support. Programs that are not installed here are replaced by /bin/true. The service
may write the recordings of the operator's guide: they are in folders that systemd creates for it."""

import os
import re
import subprocess
import tempfile

import tree

PROGRAM = re.compile(r"^(Exec\w+=[-@:+!|]*)(/\S+)", re.MULTILINE)
CAPABILITIES = re.compile(r"^(?:Ambient|Bounding|CapabilityBounding)\w*=~?(.*)$")

SERVICE = "deploy/package/linegated.service"
GUIDE = "deploy/OPERATING.md"
RECORDING = re.compile(r"\brecord: (?:\{file: )?(/[^\s,}]+)")
# The folders that systemd creates for a unit, by the setting that names them.
FOLDERS = {"StateDirectory": "/var/lib", "LogsDirectory": "/var/log", "CacheDirectory": "/var/cache"}


def known_capabilities():
    listed = subprocess.run(["systemd-analyze", "capability"], capture_output=True, text=True, check=True)
    return {line.split()[0].upper() for line in listed.stdout.splitlines() if line.startswith("cap_")}


def runnable(text):
    return PROGRAM.sub(lambda match: match[1] + (match[2] if os.access(match[2], os.X_OK) else "/bin/true"), text)


def complaints_of_systemd(path, text):
    with tempfile.TemporaryDirectory() as folder:
        unit = os.path.join(folder, os.path.basename(path))
        with open(unit, "w", encoding="utf-8") as file:
            file.write(runnable(text))
        # It exits with 0 in spite of most of its complaints.
        verified = subprocess.run(["systemd-analyze", "verify", "--man=no", unit], capture_output=True, text=True,
                                  check=False)
        said = (verified.stdout + verified.stderr).replace(unit, path).splitlines()
    if verified.returncode != 0 and not said:
        yield f"{path}: systemd-analyze ended with {verified.returncode}"
    for line in said:
        if path in line or os.path.basename(path) in line:
            yield line


def folders_of(unit):
    for setting, where in FOLDERS.items():
        for names in re.findall(rf"^{setting}=(.*)$", unit, re.MULTILINE):
            yield from (f"{where}/{name}/" for name in names.split())


def check_recordings(root):
    if not os.path.exists(os.path.join(root, SERVICE)):
        return
    writable = tuple(folders_of(tree.read(root, SERVICE)))
    for number, line in tree.lines(root, GUIDE):
        for path in RECORDING.findall(line):
            if not path.startswith(writable):
                yield f"{GUIDE}:{number}: {SERVICE} permits no recording in {path}"


def check(root):
    yield from check_recordings(root)
    capabilities = known_capabilities()
    for path in tree.files(root, (".service", ".socket", ".timer")):
        yield from complaints_of_systemd(path, tree.read(root, path))
        for number, line in tree.lines(root, path):
            match = CAPABILITIES.match(line)
            for name in match[1].split() if match else ():
                if name not in capabilities:
                    yield f"{path}:{number}: there is no capability {name}"


if __name__ == "__main__":
    tree.run(check)
