#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""A plant with DDS-Security, from `linegate security init` to commands of each role: roles x kinds of commands, and who
is refused.

secured.py LINEGATED LINEGATE PROFILES [own]   own: with DDS in a process of its own
"""

import contextlib
import json
import os
import re
import shutil
import subprocess

from plant_process import Failure, PATIENCE, end, expect, own_domain, run_test, stop, until, write

PLANT = """schema: 1
gateway: {name: plant}
dds: {security: identities/plant, process: PROCESS}
journal: {file: JOURNAL}
lines:
  - name: press
    interface: "simulated:"
    access: all
    simulate: [{node: 8, profile: digital-io}]
    nodes: [{id: 8, name: io, eds: EDS, heartbeat: 100ms}]
    history: ["io.*"]
"""
EDS = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "..", "bridges", "sim", "eds", "digital-io.eds")

# Commands, and the roles that may send them. The exit status of a refused one is 1.
COMMANDS = (
    (["versions"], {"operator", "engineer"}),
    (["sdo", "read", "press:8", "1000:00"], {"operator", "engineer"}),
    (["nmt", "start", "press:8"], {"operator", "engineer"}),
    (["sdo", "write", "press:8", "1017:00", "150"], {"engineer"}),
    (["config", "apply", "press:8"], {"engineer"}),
    (["lss", "press", "identify"], {"engineer"}),
    (["history"], {"operator", "engineer"}),
    (["history", "--node", "press:io", "--values"], {"operator", "engineer"}),
)


class Secured:
    """The programs, with the options that select domain, profiles and identity."""

    def __init__(self, folder, linegated, linegate, profiles):
        self.folder, self.linegated, self.linegate = folder, linegated, linegate
        self.domain = own_domain()
        self.profiles = profiles
        self.identities = os.path.join(folder, "identities")
        self.stolen = os.path.join(folder, "stolen")  # not below the authority, which updates its subfolders

    def security(self, *words, code=0):
        told = subprocess.run([self.linegate, "security", *words], capture_output=True, text=True, timeout=PATIENCE,
                              check=False)
        if told.returncode != code:
            raise Failure(f"security {words} ended with {told.returncode}, not {code}\n{told.stdout}{told.stderr}")
        return told

    def ask(self, identity, *words, wait=8, environment=None):
        options = [] if identity is None else ["--security", os.path.join(self.identities, identity)]
        return subprocess.run([self.linegate, "--profile", self.profiles, "--domain", self.domain, "--wait", str(wait),
                               *options, *words], capture_output=True, text=True, timeout=4 * PATIENCE, check=False,
                              env=environment)

    def lines(self, identity, **options):
        """The names of the lines that a console with that identity sees."""
        told = self.ask(identity, "--json", "lines", **options)
        return [one["line"] for one in json.loads(told.stdout).get("lines", [])] if told.returncode == 0 else []

    def until_it_ends(self, identity, words, allowed):
        """Repeats a command whose console the library did not authenticate. Returns its result."""
        def ended():
            told = self.ask(identity, *words)
            text = told.stdout + told.stderr
            refused = "not permitted by" in text or "do not name that line" in text or "which sends no commands" in text
            if (told.returncode == 0) if allowed else refused:
                return told
            if "no answer" in text or "no gateway" in text or "no line" in text:
                return None  # Fast DDS 2.9.1 does not authenticate every participant that joins late
            raise Failure(f"{identity} {words}: {told.returncode}\n{text}")
        return until(f"{identity}: {words}", ended)

    def gateway(self, plant):
        return subprocess.Popen([self.linegated, plant, "--dds-domain", self.domain, "--dds-profile", self.profiles],
                                stderr=open(os.path.join(self.folder, "log"), "w", encoding="utf-8"))


@contextlib.contextmanager
def running(secured, plant):
    process = secured.gateway(plant)
    try:
        yield process
    except BaseException:
        stop(process)
        with open(os.path.join(secured.folder, "log"), encoding="utf-8") as log:
            print(log.read())
        raise
    end(process)


def roles_have_their_commands(secured):
    for identity in ("viewer", "operator", "engineer"):
        until(f"{identity} sees the line", lambda name=identity: secured.lines(name) == ["press"])
        for words, allowed in COMMANDS:
            secured.until_it_ends(identity, words, identity in allowed)


def others_see_nothing(secured):
    shutil.copytree(os.path.join(secured.identities, "operator"), secured.stolen)
    expect("lines without an identity", secured.lines(None, wait=4), [])
    rogue = os.path.join(secured.folder, "rogue")
    secured.security("init", rogue)
    secured.security("issue", rogue, "operator", "--role", "operator")
    expect("lines with an identity of another authority",
           secured.lines(os.path.join(rogue, "operator"), wait=4), [])


def a_running_gateway_refuses_a_revoked_identity(secured, process):
    """Its holder still has the folder from before. With DDS in a process of its own the gateway replaces that process, and
    no longer authenticates the holder."""
    log = os.path.join(secured.folder, "log")
    secured.until_it_ends(secured.stolen, ["nmt", "start", "press:8"], True)
    secured.security("revoke", secured.identities, "operator")
    with open(log, encoding="utf-8") as file:
        before = len(file.read())

    def refused():
        secured.ask(secured.stolen, "--timeout", "3", "nmt", "start", "press:8")
        with open(log, encoding="utf-8") as file:
            text = file.read()[before:]
        return re.search("command nmt of operator .* refused", text) is not None or (
            process == "own" and "is replaced: revoked.crl has changed" in text)
    until("the gateway refuses the revoked identity", refused)
    expect("exit status of a revoked identity",
           secured.ask(secured.stolen, "--timeout", "3", "nmt", "start", "press:8").returncode, 1)
    secured.until_it_ends("engineer", ["nmt", "start", "press:8"], True)


def mistakes_are_named(secured, plant):
    identity = os.path.join(secured.identities, "operator")
    key = os.path.join(identity, "identity.key")
    os.chmod(key, 0o644)
    told = secured.ask("operator", "nodes")
    expect("exit status with an open key", told.returncode, 1)
    if "chmod 600" not in told.stderr:
        raise Failure(f"not named: {told.stderr}")
    os.chmod(key, 0o600)
    text = secured.security("check", identity).stdout
    expect("the check", text, "identity operator, role operator\n")
    with open(plant, encoding="utf-8") as file:
        wrong = write(os.path.join(secured.folder, "wrong.yaml"), file.read().replace("name: plant", "name: hall"))
    for words in ([secured.linegated, wrong], [secured.linegate, "check", wrong]):
        told = subprocess.run(words, capture_output=True, text=True, timeout=PATIENCE, check=False)
        expect(f"exit status of {words}", told.returncode, 2)
        if "a gateway needs an identity of role gateway with its own name, \"hall\"" not in told.stderr:
            raise Failure(f"not named: {told.stderr}")
    told = subprocess.run([secured.linegate, "check", plant], capture_output=True, text=True, timeout=PATIENCE,
                          check=False)
    if told.returncode != 0 or "DDS-Security with the identity in" not in told.stdout:
        raise Failure(f"check: {told.returncode}\n{told.stdout}{told.stderr}")


def permissions_without_named_topics_are_reported(secured, plant):
    """As an earlier version issued them: with named topics an error, without them none."""
    signed = os.path.join(secured.identities, "plant", "permissions.smime")
    kept = signed + ".new"
    os.rename(signed, kept)
    plain = os.path.join(secured.folder, "permissions")
    subprocess.run(["openssl", "smime", "-verify", "-text", "-noverify", "-in", kept, "-out", plain], check=True,
                   capture_output=True, timeout=PATIENCE)
    with open(plain, encoding="utf-8") as file:
        text = file.read()
    write(plain, re.sub("<topic>plant/.*</topic>\\s*", "", text))
    authority = [os.path.join(secured.identities, name) for name in ("ca.crt", "ca.key")]
    subprocess.run(["openssl", "smime", "-sign", "-text", "-in", plain, "-out", signed, "-signer", authority[0],
                    "-inkey", authority[1]], check=True, capture_output=True, timeout=PATIENCE)
    with open(plant, encoding="utf-8") as file:
        text = file.read()
    named = write(os.path.join(secured.folder, "named.yaml"), text + "    named: true\n")
    for words in ([secured.linegated, named], [secured.linegated, "--check", named], [secured.linegate, "check", named]):
        told = subprocess.run(words, capture_output=True, text=True, timeout=PATIENCE, check=False)
        expect(f"exit status of {words}", told.returncode, 2)
        if f"{signed}: error: does not permit the gateway to publish the named topic plant/press/DEVICE/inputs" \
                not in told.stderr:
            raise Failure(f"not named: {told.stderr}")
    check = [secured.linegate, "check"]
    expect("exit status without named topics",
           subprocess.run([*check, plant], capture_output=True, timeout=PATIENCE, check=False).returncode, 0)
    os.replace(kept, signed)
    expect("exit status with new permissions",
           subprocess.run([*check, named], capture_output=True, timeout=PATIENCE, check=False).returncode, 0)


def test(folder, linegated, linegate, profiles, process="same"):
    secured = Secured(folder, linegated, linegate, profiles)
    secured.security("init", secured.identities)
    secured.security("init", secured.identities, code=1)
    secured.security("issue", secured.identities, "plant", "--role", "gateway")
    for role in ("viewer", "operator", "engineer"):
        secured.security("issue", secured.identities, role, "--role", role)
    secured.security("issue", secured.identities, "operator", "--role", "operator", code=1)
    plant = write(os.path.join(folder, "plant.yaml"), PLANT.replace("EDS", EDS).replace("PROCESS", process)
                  .replace("JOURNAL", os.path.join(folder, "journal.db")))
    mistakes_are_named(secured, plant)
    permissions_without_named_topics_are_reported(secured, plant)
    with running(secured, plant):
        roles_have_their_commands(secured)
        others_see_nothing(secured)
        a_running_gateway_refuses_a_revoked_identity(secured, process)
        environment = {**os.environ, "LINEGATE_SECURITY": os.path.join(secured.identities, "viewer")}
        until("the identity of the environment is used",
              lambda: secured.lines(None, environment=environment) == ["press"])
        events = until("the events of the commands", lambda: secured.ask("viewer", "events", "--once").stdout)
    with open(os.path.join(folder, "log"), encoding="utf-8") as log:
        text = log.read()
    if "engineer (" not in text and "engineer (" not in events:
        raise Failure(f"no event names the subject\n{text}\n{events}")
    # A gateway that starts refuses to authenticate a revoked identity.
    with running(secured, plant):
        until("the viewer sees the line", lambda: secured.lines("viewer") == ["press"])
        expect("lines of a revoked identity", secured.lines(secured.stolen, wait=4), [])
        told = secured.ask("operator", "lines")
        if told.returncode != 1 or "is revoked" not in told.stderr:
            raise Failure(f"revoked: {told.returncode} {told.stderr}")


if __name__ == "__main__":
    run_test(test)
