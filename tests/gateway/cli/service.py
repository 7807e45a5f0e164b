#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""linegated as a service, with this program in the place of systemd: ready when its lines run, a watchdog message
while all its threads make progress and none while one is stuck (stopped by ptrace, like a debugger), and an orderly
stop.

service.py LINEGATED PROFILES
"""

import ctypes
import os
import signal
import socket
import subprocess
import tempfile
import time

from plant_process import Failure, PATIENCE, own_domain, run_test, write

WATCHDOG = 1.0  # seconds
FORCED = 70  # gateway/runtime/exit_code.h
PLANT = """schema: 1
gateway: {{name: service}}
dds: {{domain: {domain}, process: {process}, profile: {profile}}}
lines:
  - name: press
    interface: "simulated:"
    simulate: [{{node: 8, profile: digital-io}}]
  - {{name: gone, interface: "socketcan:nosuchcan9"}}
"""

PTRACE_DETACH, PTRACE_SEIZE, PTRACE_INTERRUPT = 17, 0x4206, 0x4207
WALL = 0x4000_0000  # __WALL: includes threads


class Manager:
    """Receives the messages to NOTIFY_SOCKET."""

    def __init__(self, folder):
        self.path = os.path.join(folder, "notify")
        self.socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self.socket.bind(self.path)

    def close(self):
        self.socket.close()
        os.unlink(self.path)

    def hear(self, seconds):
        """Returns the next message, or None."""
        self.socket.settimeout(max(seconds, 0.001))
        try:
            return self.socket.recv(4096).decode()
        except TimeoutError:
            return None

    def until(self, wanted, what):
        """Reads up to the wanted message, and returns the messages before it."""
        end = time.monotonic() + PATIENCE
        before = []
        while time.monotonic() < end:
            message = self.hear(end - time.monotonic())
            if message is not None and wanted(message):
                return before
            before.append(message)
        raise Failure(f"not heard: {what}; but {before}")


def ptrace(request, thread):
    libc = ctypes.CDLL(None, use_errno=True)
    libc.ptrace.argtypes = [ctypes.c_long, ctypes.c_long, ctypes.c_void_p, ctypes.c_void_p]
    libc.ptrace.restype = ctypes.c_long
    if libc.ptrace(request, thread, None, None) != 0:
        raise Failure(f"ptrace {request:x}: {os.strerror(ctypes.get_errno())}")


def thread_called(process, name):
    for thread in os.listdir(f"/proc/{process.pid}/task"):
        with open(f"/proc/{process.pid}/task/{thread}/comm", encoding="utf-8") as comm:
            if comm.read().strip() == name:
                return int(thread)
    raise Failure(f"there is no thread called {name}")


def threads_of(process, name):
    """Returns the main thread, those of Fast DDS (they have the name of the program), or the one with that name."""
    if name == "main":
        return [process.pid]
    if name != "Fast DDS":
        return [thread_called(process, name)]
    out = []
    for thread in os.listdir(f"/proc/{process.pid}/task"):
        with open(f"/proc/{process.pid}/task/{thread}/comm", encoding="utf-8") as comm:
            if comm.read().strip() == "linegated" and int(thread) != process.pid:
                out.append(int(thread))
    if not out:
        raise Failure("there is no thread of Fast DDS")
    return out


def check_stuck(manager, process, name):
    """While a thread is stopped there is no watchdog message; when it continues, there is one again."""
    thread = thread_called(process, name)
    ptrace(PTRACE_SEIZE, thread)
    ptrace(PTRACE_INTERRUPT, thread)
    os.waitpid(thread, WALL)
    manager.until(lambda message: "no progress" in message and name in message.split(";")[0], f"{name} is stuck")
    end = time.monotonic() + 3 * WATCHDOG
    while time.monotonic() < end:
        if manager.hear(end - time.monotonic()) == "WATCHDOG=1":
            raise Failure(f"{name} is stuck, and yet there was a sign of life")
    ptrace(PTRACE_DETACH, thread)
    manager.until(lambda message: message == "WATCHDOG=1", f"a sign of life after {name} goes on")


def child_called(process, name):
    """Returns the process ID of a child of the service, or None."""
    candidates = []
    for thread in os.listdir(f"/proc/{process.pid}/task"):  # the one that started it
        with open(f"/proc/{process.pid}/task/{thread}/children", encoding="utf-8") as children:
            candidates += children.read().split()
    for child in candidates:
        try:
            with open(f"/proc/{child}/comm", encoding="utf-8") as comm:
                if comm.read().strip() == name:
                    return int(child)
        except FileNotFoundError:
            pass
    return None


def check_dds_process(manager, process, status):
    """A DDS process that ends again and again is started after pauses: the status begins with that, while it is so.
    Without such a process there is nothing to check."""
    if child_called(process, "linegated-dds") is None:
        return
    wanted = "STATUS=DDS process not running, started again in "
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end:
        child = child_called(process, "linegated-dds")
        if child is not None:
            os.kill(child, signal.SIGKILL)
        message = manager.hear(0.1)
        if message is not None and message.startswith(wanted):
            if not message.endswith("; 1 of 2 lines in order; gone: absent"):
                raise Failure(f"the status does not go on with the lines: {message}")
            break
    else:
        raise Failure("the status does not mention the DDS process that does not run")
    manager.until(lambda message: message == status, "the state of the lines alone, when the DDS process works again")


def check_journal(said):
    """Each entry has a severity in the journal's notation, and no time."""
    lines = said.splitlines()
    for expected in ("<6>linegate ", "<3>gone: ", "<3>no progress within 500 ms: exec press", "<4>all threads make"):
        if not any(line.startswith(expected) for line in lines):
            raise Failure(f"the journal has no {expected}")
    if not all(line.startswith(("<3>", "<4>", "<6>")) for line in lines):
        raise Failure("an entry of the journal has no severity")


def run(manager, process):
    before = manager.until(lambda message: message == "READY=1", "READY=1")
    if any(message.startswith("STOPPING") for message in before):
        raise Failure("it stopped before it was ready")
    status = "STATUS=1 of 2 lines in order; gone: absent"
    if status not in before:
        manager.until(lambda message: message == status, "the state of the lines")
    manager.until(lambda message: message == "WATCHDOG=1", "a sign of life")
    for name in ("exec press", "publisher", "requests"):
        check_stuck(manager, process, name)
    check_dds_process(manager, process, status)
    process.send_signal(signal.SIGHUP)
    manager.until(lambda message: message.startswith("RELOADING=1\nMONOTONIC_USEC="), "RELOADING=1")
    manager.until(lambda message: message == "READY=1", "READY=1 after the reload")
    process.send_signal(signal.SIGTERM)
    manager.until(lambda message: message == "STOPPING=1", "STOPPING=1")
    if process.wait(timeout=PATIENCE) != 0:
        raise Failure(f"it ended with {process.returncode}")


def run_to_a_forced_end(manager, process, name):
    """SIGTERM ends the service even if a thread never continues."""
    manager.until(lambda message: message == "READY=1", "READY=1")
    threads = threads_of(process, name)
    for thread in threads:
        ptrace(PTRACE_SEIZE, thread)
        ptrace(PTRACE_INTERRUPT, thread)
        os.waitpid(thread, WALL)
    process.send_signal(signal.SIGTERM)
    for thread in threads:
        if thread != process.pid:
            os.waitpid(thread, WALL)  # it ends with the process, and its tracer is notified first
    if process.wait(timeout=PATIENCE) != FORCED:
        raise Failure(f"with {name} stuck it ended with {process.returncode}, not {FORCED}")


def with_service(folder, command, body):
    """Calls body with the manager and the process of a service, and returns what the service logged."""
    manager = Manager(folder)
    journal = tempfile.TemporaryFile(dir=folder)
    stream = os.fstat(journal.fileno())
    environment = dict(os.environ, NOTIFY_SOCKET=manager.path, WATCHDOG_USEC=str(int(WATCHDOG * 1e6)),
                       JOURNAL_STREAM=f"{stream.st_dev}:{stream.st_ino}")
    with journal, subprocess.Popen(command, env=environment, stderr=journal) as process:
        try:
            body(manager, process)
            journal.seek(0)
            return journal.read().decode()
        except Failure as failure:
            journal.seek(0)
            raise Failure(f"{failure}\n{journal.read().decode()}") from failure
        finally:
            process.kill()
            manager.close()


def test(folder, linegated, profiles):
    domain = own_domain()
    commands = {process: [linegated, write(os.path.join(folder, f"{process}.yaml"),
                                           PLANT.format(domain=domain, process=process, profile=profiles))]
                for process in ("own", "same")}
    for command in commands.values():
        check_journal(with_service(folder, command, run))
    for name, place in (("publisher", "own"), ("main", "own"), ("Fast DDS", "same")):
        said = with_service(folder, commands[place], lambda manager, process, name=name:
                            run_to_a_forced_end(manager, process, name))
        if "the process ends without it" not in said:
            raise Failure(f"with {name} stuck its end was not explained:\n{said}")
    bad = write(os.path.join(folder, "bad.xml"), "<dds>\n<profiles>\n</dds>\n")
    for option in ([], ["--check"]):
        told = subprocess.run([*commands["own"], "--dds-profile", bad, *option], capture_output=True, text=True,
                              timeout=PATIENCE, check=False)
        if told.returncode != 2 or f"{bad}:3:" not in told.stderr:
            raise Failure(f"a bad file of DDS profiles, {option}: {told.returncode} {told.stderr}")


if __name__ == "__main__":
    run_test(test)
