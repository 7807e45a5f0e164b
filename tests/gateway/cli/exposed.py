#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""A gateway warns once at each start if hosts of a network may command its plant, and only then: DDS is open on an
interface other than loopback, and a line permits commands or outputs, or sends EMCYs of other gateways.

exposed.py LINEGATED LINEGATE LOOPBACK_PROFILES
"""

import os
import signal
import subprocess

from plant_process import Failure, PATIENCE, SOURCES, own_domain, run_test, write

OPEN_PROFILES = os.path.join(SOURCES, "deploy", "dds", "linegate-profiles.xml")
WARNING = "DDS is open without DDS-Security"
ROUTES = "routes: [{to: 7, via: hall-b/press, emcy: true}]"
PLANT = """schema: 1
gateway: {{name: exposed}}
{routes}
lines:
  - name: seen
    interface: "simulated:"
    access: read
    simulate: [{{node: 8, profile: digital-io}}]
  - name: moved
    interface: "simulated:"
    access: {access}
    network_id: 2
    enter: [{{from: 7, services: [emcy]}}]
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
    commands, emcys = "outputs to moved", "EMCYs on the bus of moved"
    cases = ((OPEN_PROFILES, "all", "", [commands]), (OPEN_PROFILES, "{commands: read, outputs: all}", "", [commands]),
             (OPEN_PROFILES, "read", "", []), (loopback, "all", "", []), (OPEN_PROFILES, "read", ROUTES, [emcys]),
             (OPEN_PROFILES, "all", ROUTES, [commands, emcys]), (loopback, "read", ROUTES, []))
    for profiles, access, routes, actions in cases:
        plant = write(os.path.join(folder, "plant.yaml"), PLANT.format(access=access, routes=routes))
        log = log_of(linegated, plant, profiles)
        warnings = [line for line in log.splitlines() if WARNING in line]
        if len(warnings) != (1 if actions else 0):
            raise Failure(f"{profiles}, access {access}: {len(warnings)} warnings for {actions}\n{log}")
        for warning in warnings:
            named = [action for action in (commands, emcys) if action in warning]
            if "UDPv4 on every interface" not in warning or named != actions:
                raise Failure(f"the warning does not name transport and lines: {warning}")


if __name__ == "__main__":
    run_test(test, own_network=True)
