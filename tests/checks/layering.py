#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Dependencies have one direction: gateway -> bridges -> stack, idl -> bridges/dds, and from part to part in
gateway/. Fails if an #include violates it, or if a folder uses a header that the rules of the project reserve for
another folder."""

import re
from pathlib import PurePosixPath

import tree

# A part may use the parts before it.
STACK_PARTS = "base can od eds sdo usdo nmt sync time emcy lss image pdo storage node profile manager srdo diagnosis scan observer routing line".split()

# A part of the gateway may use the parts before it.
GATEWAY_ROOMS = "exchange config security runtime journal edge publish process tools client doctor cli".split()
# Exceptions: exchange is only for the threads, and the commands that run without a gateway must not depend on one.
ROOM_TO_ROOM_FORBIDDEN = {("config", "exchange"), ("tools", "process")}

STACK_FORBIDDEN = {
    "atomic", "barrier", "condition_variable", "csignal", "cstdio", "ctime", "filesystem", "fstream",
    "future", "iostream", "latch", "mutex", "semaphore", "shared_mutex", "stop_token", "syncstream",
    "thread",
}

# Header (as a pattern) -> the only product folders, or files, that may use it, and why.
RESERVED = [
    (r"atomic", ["gateway/exchange", "bridges/dds/guard"],
     "atomics live in gateway/exchange, and in the guard's counters"),
    (r"thread|stop_token|future", ["gateway", "bridges/dds/guard/delivery_thread.h"],
     "bridges start no thread, the gateway owns all, but one in the place of Fast DDS's receiving threads"),
    (r"fast(dds|rtps|cdr)/.*", ["bridges/dds"], "replacing Fast DDS must touch bridges/dds alone"),
    (r"linegate(PubSubTypes)?\.h", ["bridges/dds"], "the DDS contract is known to bridges/dds alone"),
    (r"linux/can.*", ["bridges/can"], "SocketCAN is bridges/can's subject"),
    (r"msgpack(/.*|\.hpp)", ["bridges/can"], "frames in datagrams are bridges/can's subject"),
    (r"yaml-cpp/.*", ["gateway"], "configuration is the gateway's subject"),
    (r"pugixml\.hpp", ["bridges/xdd", "bridges/dds"], "XML is the subject of bridges/xdd and of DDS profiles"),
    (r"sqlite3\.h", ["gateway/journal"], "the journal is the only database"),
    (r"openssl/.*", ["gateway/security"], "OpenSSL is the subject of gateway/security"),
    (r"spdlog/.*", ["gateway"], "logs are rendered in the gateway"),
]

# The only bridges that may use another folder of bridges/: simulated devices attach to any interface; bridges/request and
# bridges/named are no edges, but the requests that clients send and the types of named topics. bridges/client is the client
# library, whose samples are those of bridges/dds.
BRIDGE_TO_BRIDGE = {("sim", "can"), ("dds", "request"), ("console", "request"), ("dds", "named"),
                    ("client", "dds"), ("client", "request")}
PRODUCT = ("stack", "bridges", "gateway", "idl")

CLOCK = re.compile(r"\b(steady|system|high_resolution|utc)_clock::now\b")
INCLUDE = re.compile(r'^\s*#\s*include\s*([<"])([^>"]+)[>"]')


def is_standard(header):
    return re.fullmatch(r"[a-z_]+", header) is not None


def stack_complaint(source, header, quoted):
    part = source.parts[1]
    if not quoted:
        if not is_standard(header):
            return "stack/ uses the C++ standard library alone"
        if header in STACK_FORBIDDEN:
            return "stack/ has no thread, atomic, clock or I/O"
        return None
    target = PurePosixPath(header)
    if len(target.parts) < 3 or target.parts[0] != "stack":
        return "stack/ knows nothing outside stack/"
    if part not in STACK_PARTS or target.parts[1] not in STACK_PARTS:
        return "a part of stack/ that the order of parts does not name"
    if STACK_PARTS.index(target.parts[1]) > STACK_PARTS.index(part):
        return f"stack/{target.parts[1]} comes after stack/{part}"
    return None


def bridge_complaint(source, header):
    bridge = source.parts[1]
    target = PurePosixPath(header).parts
    if target[0] == "gateway":
        return "bridges know nothing of the gateway"
    if target[0] == "bridges" and target[1] != bridge and (bridge, target[1]) not in BRIDGE_TO_BRIDGE:
        return "a bridge knows no other bridge"
    if target[0] == "idl" and bridge != "dds":
        return "the DDS contract is known to bridges/dds alone"
    return None


def gateway_complaint(source, header):
    room, target = source.parts[1], PurePosixPath(header)
    if target.parts[:2] == ("bridges", "dds") and str(source) not in DDS_EDGES:
        return f"of gateway/ only {' and '.join(DDS_EDGES)} know bridges/dds"
    if target.parts[0] != "gateway":
        return None
    used = target.parts[1]
    if room not in GATEWAY_ROOMS or used not in GATEWAY_ROOMS:
        return "a room of gateway/ that the order of rooms does not name"
    if GATEWAY_ROOMS.index(used) > GATEWAY_ROOMS.index(room) or (room, used) in ROOM_TO_ROOM_FORBIDDEN:
        return f"gateway/{room} does not use gateway/{used}"
    return None


# The only files of the gateway that include bridges/dds: as publisher, and as subscriber.
DDS_EDGES = ("gateway/publish/dds_edge.cpp", "gateway/publish/dds_peers.cpp", "gateway/publish/dds_process.cpp",
             "gateway/publish/dds_process_main.cpp", "gateway/publish/peer_process.cpp", "gateway/cli/remote_client.cpp",
             "gateway/client/connect.cpp", "gateway/client/identity.h", "gateway/doctor/observations.h", "gateway/doctor/examine.cpp",
             "gateway/doctor/listener.cpp", "gateway/doctor/prober.cpp", "gateway/doctor/prober.h")


def reserved_complaint(source, header):
    for pattern, folders, reason in RESERVED:
        if re.fullmatch(pattern, header) and not any(
            str(source) == folder or str(source).startswith(folder + "/") for folder in folders
        ):
            return reason
    return None


def complaint_about(path, header, quoted):
    """Returns why this include violates the rules, or None."""
    source = PurePosixPath(path)
    house = source.parts[0]
    if house == "tests" or house not in PRODUCT:
        return None
    if quoted and header.startswith("tests/"):
        return "the product never depends on tests/"
    if quoted and header.split("/")[0] not in PRODUCT:
        return "an include names the house: the repository is the include root"
    if house == "stack":
        return stack_complaint(source, header, quoted)
    if quoted and house == "bridges":
        return bridge_complaint(source, header)
    if quoted and house == "gateway":
        return gateway_complaint(source, header)
    return None if quoted else reserved_complaint(source, header)


def check(root):
    for path in tree.files(root, (".h", ".cpp", ".c")):
        for number, line in tree.lines(root, path):
            if path.startswith("stack/") and CLOCK.search(line):
                yield f"{path}:{number}: stack/ never asks a clock, it is told the time"
            found = INCLUDE.match(line)
            if not found:
                continue
            reason = complaint_about(path, found[2], found[1] == '"')
            if reason:
                yield f"{path}:{number}: {found[2]}: {reason}"


if __name__ == "__main__":
    tree.run(check)
