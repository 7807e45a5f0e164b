#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""A gateway with process images by multicast, a client that asks for them, and two readers with Cyclone DDS, which ask for a
group of their own: each receives images, each once and in order. In a network of its own, whose loopback carries multicast.

fan_out.py DDS_PEER CYCLONE_IMAGES
"""

import json
import os
import re
import subprocess
import sys
import threading

FOLDER = os.path.dirname(os.path.abspath(__file__))
sys.path.append(os.path.join(FOLDER, "..", "gateway", "cli"))
from plant_process import Failure, run_test, until, write  # noqa: E402 pylint: disable=wrong-import-position

DOMAIN = "7"
IMAGES = 100


class Reader:
    """A program that prints what it receives; number() is the number of the image in a line of it, or None."""

    def __init__(self, name, number, *words, **options):
        self.name, self.number, self.numbers = name, number, []
        self.process = subprocess.Popen(words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, **options)
        threading.Thread(target=self._read, daemon=True).start()

    def _read(self):
        for line in self.process.stdout:
            number = self.number(line)
            if number is not None:
                self.numbers.append(number)

    def receives_images(self):
        """A process that does not run for a while skips some, because a reader keeps the newest alone."""
        until(f"{self.name} receives images", lambda: len(self.numbers) > IMAGES)
        numbers = self.numbers[:]
        if numbers != sorted(set(numbers)):
            raise Failure(f"{self.name}: {numbers}")


def of_client(line):
    found = re.fullmatch(r"image (\d+)\n", line)
    return int(found[1]) if found else None


def of_cyclone(line):
    sample = json.loads(line)
    return sample["sequence_number"] if sample["topic"] == "ProcessImage" else None


def test(folder, dds_peer, cyclone_images):
    subprocess.run(["ip", "link", "set", "lo", "multicast", "on"], check=True)
    with open(os.path.join(FOLDER, "cyclone.xml"), encoding="utf-8") as file:
        settings = file.read()
    multicast = write(os.path.join(folder, "cyclone.xml"),
                      settings.replace("<AllowMulticast>false", "<AllowMulticast>true"))
    environment = {**os.environ, "CYCLONEDDS_URI": "file://" + multicast}
    gateway = subprocess.Popen([dds_peer, "multicast_gateway", DOMAIN], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                               text=True)
    if gateway.stdout.readline() != "ready\n":
        raise Failure("the gateway did not start")
    readers = [Reader("the client", of_client, dds_peer, "multicast_subscriber", DOMAIN)]
    readers += [Reader(f"Cyclone DDS {i}", of_cyclone, cyclone_images, DOMAIN, env=environment) for i in (1, 2)]
    try:
        for reader in readers:
            reader.receives_images()
        gateway.stdin.close()
        if gateway.wait(timeout=30) != 0:
            raise Failure(f"the gateway ended with {gateway.returncode}")
    finally:
        for process in [gateway, *(reader.process for reader in readers)]:
            process.kill()


if __name__ == "__main__":
    run_test(test, own_network=True)
