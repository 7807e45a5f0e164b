#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""A gateway warns once at each start if hosts of a network may command its plant, and only then: DDS is open on an
interface other than loopback, and a line permits commands or outputs.

exposed.py LINEGATED LINEGATE LOOPBACK_PROFILES
"""

import os
import signal
import subprocess

from plant_process import Failure, PATIENCE, SOURCES, own_domain, run_test, write

OPEN_PROFILES = os.path.join(SOURCES, "deploy", "dds", "linegate-profiles.xml")
WARNING = "DDS is open without DDS-Security"
PLANT = """schema: 1
gateway: {{name: exposed}}
lines:
  - name: seen
    interface: "simulated:"
    access: read
    simulate: [{{node: 8, profile: digital-io}}]
  - name: moved
    interface: "simulated:"
    access: {access}
    simulate: [{{node: 8, profile: digital-io}}]
"""


def log_of(linegated, plant, profiles):
    """Returns the log of a gateway that started, was reloaded and ended."""
    domain = own_domain()
    process = subprocess.Popen([linegated, plant, "--dds-domain", domain, "--dds-profile", profiles],
                               stderr=subprocess.PIPE, text=True)
    log = ""
    signals = {" starts: gateway": signal.SIGHUP, "reloaded": signal.SIGTERM}
    for line in process.stderr:
        log += line
        for text in [text for text in signals if text in line]:
            process.send_signal(signals.pop(text))
    if process.wait(timeout=PATIENCE) != 0:
        raise Failure(f"it ended with {process.returncode}\n{log}")
    return log


def test(folder, linegated, _, loopback):
    cases = ((OPEN_PROFILES, "all", 1), (OPEN_PROFILES, "{commands: read, outputs: all}", 1),
             (OPEN_PROFILES, "read", 0), (loopback, "all", 0))
    for profiles, access, wanted in cases:
        plant = write(os.path.join(folder, "plant.yaml"), PLANT.format(access=access))
        log = log_of(linegated, plant, profiles)
        warnings = [line for line in log.splitlines() if WARNING in line]
        if len(warnings) != wanted:
            raise Failure(f"{profiles}, access {access}: {len(warnings)} warnings, not {wanted}\n{log}")
        for warning in warnings:
            if "UDPv4 on every interface" not in warning or "outputs to moved:" not in warning:
                raise Failure(f"the warning does not name transport and line: {warning}")


if __name__ == "__main__":
    run_test(test, own_network=True)
