# SPDX-License-Identifier: Apache-2.0
"""Where the commands of a document are run: a copy of what they name, in a network of its own, with devices."""

import json
import os
import re
import shutil
import signal
import subprocess
import time

from plant_process import EDS, PATIENCE, SOURCES, Failure

INTERFACE = re.compile(r"socketcan:(v?can)(\d+)(\?[^\s\"'#},]*)?")
# The lines of a plant on interfaces that other programs reach, and their nodes.
LINE = re.compile(r"interface: \"?(udp:[^\s\"]+)\"?\n((?:    .*\n|\n)*)")
NODE = re.compile(r"\bid: (\d+).*?eds: ([^\s,}]+)", re.DOTALL)
# A plant of which the documents say that it is there, too: another gateway with network 12.
BEYOND = "beyond.yaml"
BEYOND_PLANT = """schema: 1
gateway: {name: beyond}
lines:
  - name: far
    interface: "simulated:"
    network_id: 12
    nodes: [{id: 5, eds: bridges/sim/eds/digital-io.eds, heartbeat: 500ms}]
    simulate: [{node: 5, profile: digital-io}]
"""
# The plant of the operator's guide: lines and nodes that its commands name.
GUIDE_PLANT = """schema: 1
gateway: {name: hall-7}
lines:
  - name: press
    interface: "simulated:"
    access: all
    sync: 50ms
    enter: hall
    nodes:
      - {id: 5, name: inlet, eds: devices/ram.eds, heartbeat: 500ms}
      - {id: 6, name: ram, eds: devices/ram.eds, heartbeat: 500ms}
      - {id: 8, name: panel, eds: devices/inlet.eds, heartbeat: 500ms}
      - id: 10
        name: mixer
        eds: devices/scale.eds
        heartbeat: 500ms
        pdos: {tpdo3: {rtr: true}}
        values:
          6411:1: {alias: Valve, unit: "%", scale: 0.01, low: 0, high: 100}
    outputs:
      defaults: {"mixer.6411:2": 0}
    own_objects:
      "2100:1": {type: u32, map: true}
      "2100:2": {type: u32, map: true}
    own_pdos: {tpdo100: {cob_id: 0x1F0, mpdo: destination, map: ["2100:1"]}, tpdo101: {cob_id: 0x1F1, mpdo: source}}
    mpdo_scanner: [{object: "2100:1", count: 2}]
    simulate:
      - {node: 5, profile: drive}
      - {node: 6, profile: drive}
      - {node: 8, profile: digital-io}
      - {node: 10, profile: analog-io}
  - name: hall
    interface: "simulated:"
    nodes: [{id: 10, name: doors, eds: devices/inlet.eds, heartbeat: 500ms}]
    simulate: [{node: 10, profile: digital-io}]
  - name: plc
    interface: "virtual:plc"
    access: all
    role: device
    devices:
      - {id: 10, name: panel, profile: 401, digital_inputs: 2}
      - {id: 11, name: drive, eds: devices/recipe.eds}
"""
# Times that gateway and devices hold on a busy machine: what the documents show is without lost heartbeats and time-outs.
A_LINE = re.compile(r"^  - name: .*\n(?:    .*\n|\n|  +#.*\n)*", re.MULTILINE)
AN_INTERFACE = re.compile(r"^    interface: .*\n", re.MULTILINE)
PRODUCER = re.compile(r"((?:\bid: |^        ).*?\bheartbeat: )(\d+m?s)\b", re.MULTILINE)
CONSUMER, SDO_TIMEOUT = "5s", "10s"
# What the guide decodes.
GUIDE_LOG = """(1795255000.103120) press 605#2B171000C8000000
(1795255000.103391) press 585#6017100000000000
"""
# Commands that end with a signal. Each goes on until the condition is true, then gets SIGINT.
UNTIL_OUTPUT = ("linegate events", "linegate record")
UNTIL_END_OF_BLOCK = ("linegate listen", "linegate trace", "linegate --json monitor |")
INTERRUPTED = (0, 128 + signal.SIGINT, -signal.SIGINT)


def on_this_machine(text):
    """The text with interfaces and folders that are here: a multicast group for a CAN interface, /etc below the copy."""
    def group(found):
        number = int(found[2]) + (1 if found[1] == "can" else 11)
        return f"udp:239.74.163.{100 + number}:{43200 + number}"
    return INTERFACE.sub(group, text).replace("/etc/linegate", "etc/linegate")


def on_a_busy_machine(plant):
    """The plant with times that are held on a busy machine, in the lines that have nodes to monitor."""
    def patient(found):
        line = found[0]
        if "role: device" in line:
            return line
        line = PRODUCER.sub(rf"\1{{producer: \2, consumer: {CONSUMER}}}", line)
        return AN_INTERFACE.sub(rf"\g<0>    sdo_timeout: {SDO_TIMEOUT}\n", line)
    return A_LINE.sub(patient, plant)


class Process:
    """A command in a shell of its own, in a process group of its own; its output goes to a file."""

    def __init__(self, stage, text):
        self.text = text
        stage.started += 1
        self.path = os.path.join(stage.folder, f"output-{stage.started}")
        with open(self.path, "wb") as output:
            self.shell = subprocess.Popen(["bash", "-c", on_this_machine(text)], cwd=stage.folder, env=stage.environment,
                                          stdin=subprocess.DEVNULL, stdout=output, stderr=subprocess.STDOUT,
                                          start_new_session=True)

    def output(self):
        with open(self.path, encoding="utf-8", errors="replace") as file:
            return file.read()

    def signal(self, number):
        """Sends a signal to all that the command started."""
        try:
            os.killpg(self.shell.pid, number)
        except ProcessLookupError:
            pass

    def wait(self):
        """Its exit status; fails when it does not end."""
        try:
            return self.shell.wait(timeout=PATIENCE)
        except subprocess.TimeoutExpired as late:
            self.signal(signal.SIGKILL)
            raise Failure(f"does not end: {self.text}\n{self.output()}") from late

    def group_ended(self):
        try:
            os.killpg(self.shell.pid, 0)
        except ProcessLookupError:
            return True
        return False


class Stage:
    """A folder with what the documents name, and the programs that their commands started in it."""

    def __init__(self, folder, programs):
        self.folder, self.started = folder, 0
        self.background = []
        self.environment = {**os.environ, "LC_ALL": "C", "TZ": "UTC",
                            "PATH": f"{programs}:{os.environ['PATH']}"}
        os.makedirs(os.path.join(folder, "build/release"))
        os.symlink(programs, os.path.join(folder, "build/release/bin"))
        shutil.copytree(os.path.join(SOURCES, "deploy"), os.path.join(folder, "deploy"))
        shutil.copytree(os.path.join(SOURCES, "idl"), os.path.join(folder, "idl"))
        shutil.copytree(EDS, os.path.join(folder, "bridges/sim/eds"))
        for path in ("devices", "etc/linegate"):
            os.makedirs(os.path.join(folder, path))
        self.plant(BEYOND, BEYOND_PLANT)
        for plant in ("vcan.yaml", "demo.yaml"):
            self.plant(f"deploy/plants/{plant}", self.read(f"deploy/plants/{plant}"))

    def read(self, path):
        with open(os.path.join(self.folder, path), encoding="utf-8") as file:
            return file.read()

    def write(self, path, text):
        """Writes a file of the folder, with interfaces that are here."""
        with open(os.path.join(self.folder, path), "w", encoding="utf-8") as file:
            file.write(on_this_machine(text))

    def plant(self, path, text):
        """Writes a plant that a gateway runs."""
        self.write(path, on_a_busy_machine(text))

    def run(self, text):
        """The exit status and the output of a command that ends by itself."""
        process = Process(self, text)
        status = process.wait()
        if not process.group_ended():
            self.background.append(process)
        return status, process.output()

    def console(self, words):
        """The output of linegate, or None while it has none."""
        status, output = self.run(f"build/release/bin/linegate {words} 2>/dev/null")
        return output if status == 0 else None

    def until(self, what, condition):
        last = time.monotonic() + PATIENCE
        while not (found := condition()):
            if time.monotonic() > last:
                logs = "\n".join(process.output() for process in self.background)
                raise Failure(f"not within {PATIENCE} s: {what}\n{logs}")
            time.sleep(0.1)
        return found

    def await_lines(self):
        """Waits until every line that is there has its nodes."""
        def ready():
            lines = json.loads(self.console("--json lines") or "{}").get("lines", [])
            return lines and all(line.get("nodes_operational") == line.get("nodes_configured") for line in lines
                                 if line.get("role") != "device")
        self.until("all nodes of all lines are operational", ready)

    def start_nodes(self):
        """Starts the nodes of press, once all have booted."""
        def present():
            nodes = json.loads(self.console("--json nodes press") or "[]")
            return nodes and all(node["presence"] == "present" and node["boot_text"].startswith("booted") for node in nodes)
        self.until("all nodes of press have booted", present)
        self.console("nmt start press:all")

    def begin(self, text):
        """Starts a program that runs until something else is begun."""
        process = Process(self, text)
        self.background.append(process)
        return process

    def gateway(self, text):
        """Starts the gateway of a document, with the devices of its plant, in the place of what runs."""
        self.end()
        plant = next(word for word in text.split() if word.endswith(".yaml"))
        for interface, nodes in LINE.findall(self.read(plant)):
            devices = [(node, self.profile(os.path.join(os.path.dirname(plant), file))) for node, file in NODE.findall(nodes)]
            words = " ".join(f"--device {profile}:{node}" for node, profile in devices)
            self.begin(f"build/release/bin/linegate simulate {interface} {words}")
        self.begin(f"build/release/bin/linegated {BEYOND}")
        self.begin(text)
        self.await_lines()

    def profile(self, file):
        """The simulated device of which the device file is a copy."""
        return next(name[:-4] for name in os.listdir(EDS) if name.endswith(".eds") and self.read(file) == self.read(
            f"bridges/sim/eds/{name}"))

    def end(self):
        """Ends all that runs, the newest first; each has to stop in good order."""
        wrong = []
        for process in reversed(self.background):
            process.signal(signal.SIGTERM)
            status = process.wait()
            if status not in (0, 128 + signal.SIGTERM, -signal.SIGTERM):
                wrong.append(f"ended with {status}: {process.text}\n{process.output()}")
            last = time.monotonic() + PATIENCE
            while not process.group_ended() and time.monotonic() < last:
                time.sleep(0.02)
        self.background = []
        if wrong:
            raise Failure("\n".join(wrong))

    def kill(self):
        for process in self.background:
            process.signal(signal.SIGKILL)
