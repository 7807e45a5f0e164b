# SPDX-License-Identifier: Apache-2.0
"""stranger.js on an interface: its frames, and the requests to it."""

import json
import os
import queue
import socket
import struct
import subprocess
import threading

from actors import FOLDER, PATIENCE, Actor, Failed

PROGRAM = os.path.join(os.path.dirname(os.path.abspath(__file__)), "stranger.js")
FRAME = struct.Struct("<IB3x8s")  # struct can_frame


class Stranger:
    def __init__(self, interface, node, modules, *options):
        self.node = node
        self.heard = []  # as a master: (what, value)
        self.eds = os.path.join(FOLDER, f"stranger-{node}.eds")
        self.bus = socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW)
        self.bus.bind((interface,))
        self.answers = queue.Queue()
        self.writing = threading.Lock()
        self.process = subprocess.Popen(
            ["node", PROGRAM, modules, str(node), self.eds, *options],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        Actor.everyone.append(self)
        self.name = f"stranger-{node}"
        for work in (self.hear, self.speak):
            threading.Thread(target=work, daemon=True).start()

    def tell(self, value):
        with self.writing:
            self.process.stdin.write(json.dumps(value) + "\n")
            self.process.stdin.flush()

    def hear(self):
        """From the bus to the foreign stack."""
        try:
            while True:
                identifier, length, data = FRAME.unpack(self.bus.recv(FRAME.size))
                self.tell({"id": identifier, "data": data[:length].hex()})
        except OSError:  # it has ended
            pass

    def speak(self):
        """From the foreign stack to the bus, or to the caller of a request."""
        for line in self.process.stdout:
            value = json.loads(line)
            if "id" in value:
                data = bytes.fromhex(value["data"])
                self.bus.send(FRAME.pack(value["id"], len(data), data))
            elif "heard" in value:
                self.heard.append((value["heard"], value["value"]))
            else:
                self.answers.put(value)

    def forget(self):
        """Discards the reports so far."""
        self.heard.clear()

    def last(self, what):
        """Returns the value of the last such report; None if there was none."""
        return next((value for name, value in reversed(self.heard) if name == what), None)

    def nmt(self, command, server=None):
        self.tell({"ask": "nmt", "command": command, "server": server})
        return self.next_answer()

    def send_pdo(self, data):
        self.tell({"ask": "pdo", "data": data.hex()})
        return self.next_answer()

    def ask(self, what, server, index, sub, data=""):
        self.tell({"ask": what, "server": server, "index": index, "sub": sub, "data": data})
        return self.next_answer()

    def next_answer(self):
        try:
            return self.answers.get(timeout=PATIENCE)
        except queue.Empty:
            raise Failed("the stranger does not answer") from None

    def upload(self, server, index, sub):
        """Returns the bytes, or the reason for a failure."""
        answer = self.ask("upload", server, index, sub)
        return bytes.fromhex(answer["answer"]) if "answer" in answer else answer["refused"]

    def download(self, server, index, sub, data):
        """Returns nothing, or the reason for a failure."""
        return self.ask("download", server, index, sub, data.hex()).get("refused")

    # The interface of Actor.

    def text(self):
        return ""

    def runs(self):
        return self.process.poll() is None

    def kill(self):
        self.process.kill()
        self.process.wait()
