#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""A console command that waits for a gateway ends at once on a signal, not at the end of its wait.

interrupted.py LINEGATE PROFILES
"""

import os
import signal
import subprocess
import sys
import time

from plant_process import own_domain

PATIENCE = 60  # seconds; the command itself would wait far longer


def is_waiting(process):
    """Whether it has created its participant: DDS has threads of its own."""
    return len(os.listdir(f"/proc/{process.pid}/task")) > 4


def main(linegate, profiles):
    domain = own_domain()
    command = [linegate, "--profile", profiles, "--domain", domain, "--wait", "3600", "nodes"]
    with subprocess.Popen(command) as process:
        try:
            end = time.monotonic() + PATIENCE
            while not is_waiting(process) and time.monotonic() < end:
                time.sleep(0.05)
            # Its remaining set-up follows the creation of its participant.
            time.sleep(1)
            process.send_signal(signal.SIGTERM)
            process.wait(timeout=PATIENCE)
        except subprocess.TimeoutExpired:
            return "it still waits"
        finally:
            process.kill()
    return None if process.returncode == -signal.SIGTERM else f"it ended with {process.returncode}"


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
