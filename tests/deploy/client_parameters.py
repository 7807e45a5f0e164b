#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""The ranges of the parameters of all typed commands in Python: both ends begin a call; what is beyond is refused at once, and the
error names the parameter and its range. None is cut to what a member holds. Without a gateway.

client_parameters.py BUILD LINEGATED. In a separate network namespace.
"""

import inspect
import os
import sys

from installed_client import Installed

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "gateway", "cli"))
from plant_process import expect, raised, run_test  # noqa: E402 pylint: disable=wrong-import-position

NODE, NODE_OR_0, WORD, BYTE = (1, 127, "1..127"), (0, 127, "0..127"), (0, 0xFFFF, "0..FFFFh"), (0, 0xFF, "0..255")
PDO, IDENTIFIER = (1, 0xFFFF, "1..65535"), (0, 0x1FFF_FFFF, "0..1FFFFFFFh")
TIME = (-(1 << 63), (1 << 63) - 1, "-9223372036854775808..9223372036854775807")
OWN_INDEX, WHOLE = (0x2000, 0x9FFF, "2000h..5EFFh or 6000h..9FFFh"), (0, 0xFFFF_FFFF, "0..FFFFFFFFh")
# Of all commands with a parameter of that name, unless they have a range of their own.
RANGES = {"node": NODE_OR_0, "index": WORD, "sub": BYTE, "network": (1, 0xFFFF, "1..65535"), "first": WORD, "last": WORD,
          "table": BYTE, "known": (0, 15, "0..15"), "delay_ms": (0, 0xFFFF, "0..65535 ms"), "number": PDO,
          "tpdo": (0, 512, "0..512"), "code": WORD, "error_register": BYTE, "length": (0, 8, "0..8"), "mask": IDENTIFIER,
          "client": NODE, "server": NODE, "image_byte": WHOLE, "severity": (0, 2, "0..2"), "kind": BYTE, "most": (0, 0xFFFF_FFFF, "0..4294967295"),
          "since": TIME, "until": TIME,
          "highest_revision": WHOLE, "highest_serial": WHOLE}
OWN = {**{(name, "node"): NODE for name in ("sdo_read", "sdo_write", "write_object", "read_network", "write_network",
                                            "program")},
       ("nmt", "command"): (1, 130, "1, 2, 128, 129 or 130"), ("program", "number"): (1, 0xFF, "1..255"),
       ("close_connection", "number"): WHOLE, ("remove_object", "index"): OWN_INDEX, ("lss_set_bit_timing", "index"): BYTE,
       ("lss_set_node_id", "node"): (1, 127, "1..127 or 255"), ("listen", "seconds"): (0, 3600, "0..3600"),
       ("listen", "identifier"): IDENTIFIER, ("trace_routing", "seconds"): (1, 3600, "1..3600"),
       ("request_pdo", "number"): (1, 512, "1..512"),
       ("send_frame", "identifier"): (0, 0x7FF, "0..7FFh"), ("send_remote_frame", "identifier"): (0, 0x7FF, "0..7FFh")}
IN_MESSAGES = {"delay_ms": "delay"}
NO_COMMANDS = {"attempts"}
SHORT, LONG = b"\7\7", {"timeout": 60}


def examples(linegate):
    """A value of each parameter that has no default."""
    return {"node": 1, "index": 0x2000, "sub": 0, "network": 1, "value": SHORT, "number": 1, "program": SHORT, "table": 0,
            "delay_ms": 1, "code": 0x1000, "error_register": 1, "identifier": 1, "data": SHORT, "length": 1, "seconds": 1,
            "client": 1, "server": 2, "command": 1, "configuration": True, "object_": True, "faults": "lost=1%",
            "address": linegate.commands.LssAddress(1, 2, 3, 4), "lowest": linegate.commands.LssAddress(),
            "highest_revision": 1, "highest_serial": 1,
            "described": linegate.commands.ListedObject(0x2000, 0, 6, 2, name="Speed", value=SHORT)}


def commands(linegate, line):
    """Name, function, and names of the parameters that are integers, and of those that are required."""
    typed = linegate.commands.Commands(line)
    for of, names in ((line, ("sdo_read", "sdo_write", "nmt")), (typed, sorted(dir(typed)))):
        for name in names:
            if name.startswith("_") or name in ("write_output", "trigger_pdos_of"):  # by name, of a line that is ready
                continue
            function = getattr(of, name)
            parameters = {one.name: one for one in inspect.signature(function).parameters.values()
                          if one.kind is not one.VAR_KEYWORD and one.name not in NO_COMMANDS}
            numbers = [one.name for one in parameters.values() if one.annotation in ("int", "Optional[int]")]
            required = [one.name for one in parameters.values() if one.default is one.empty]
            yield name, function, numbers, required


def refusal(linegate, function, arguments):
    """The text of the error that the command ends with at once."""
    def call():
        begun = function(**arguments)
        expect(f"{function.__name__} {arguments} has ended", begun.done, True)
        begun.result()
    return str(raised((linegate.CallError, ValueError, linegate.Error), call))


def check(linegate, name, function, number, arguments):
    """Both ends of the range, and beyond."""
    lowest, highest, words = OWN.get((name, number), RANGES.get(number, (None, None, None)))
    expect(f"{name} has a range of {number}", lowest is not None, True)
    for value in (lowest, highest):
        call = function(**{**arguments, number: value}, **LONG)
        expect(f"{name} {number} {value}", call.outcome, linegate.Outcome.PENDING)
        call.cancel()
    text = f"{IN_MESSAGES.get(number, number)} is not {words}"
    for value in (lowest - 1, highest + 1, 1 << 32, (1 << 32) + max(1, lowest), 1 << 64, -(1 << 64)):
        if not lowest <= value <= highest:
            expect(f"{name} {number} {value}", refusal(linegate, function, {**arguments, number: value}), text)
    expect(f"{name} {number}", str(raised(TypeError, lambda: function(**{**arguments, number: "1"}))),
           f"{number} is an integer, not str")


def structs(linegate, line):
    """Numbers in arguments that are no integers themselves."""
    typed, object_of, address = (linegate.commands.Commands(line), linegate.commands.ListedObject,
                                 linegate.commands.LssAddress)
    for described, text in ((object_of(0x12000, 0, 6, 2), "index is not 2000h..5EFFh or 6000h..9FFFh"),
                            (object_of(0x2000, 256, 6, 2), "sub is not 0..254"),
                            (object_of(0x2000, 0, 6, 256 + 2), "access is not 0..5"),
                            (object_of(0x2000, 0, 0x10006, 2), "data has a data type that CiA 301 does not define"),
                            (object_of(0x2000, 0, 6, 2, name="x" * 256), "name is not 0..255 bytes")):
        expect("an object", refusal(linegate, typed.create_object, {"described": described}), text)
    for part in ("vendor", "product", "revision", "serial"):
        for value in (-1, 1 << 32):
            expect("an address", refusal(linegate, typed.lss_switch_selective, {"address": address(**{part: value})}),
                   f"address.{part} is not 0..FFFFFFFFh")
    expect("an EMCY", str(raised(ValueError, lambda: typed.send_emcy(1, 1, bytes(6)))), "manufacturer is not 0..5 bytes")
    expect("a cursor", str(raised(ValueError, lambda: typed.read_journal(cursor=bytes(15)))),
           "cursor is not the 16 bytes of a page")
    with_node = {"node": 5, "number": 513}
    expect("an RPDO of a node", refusal(linegate, typed.trigger_pdo, with_node), "number is not 1..512")
    expect("attempts", refusal(linegate, typed.boot, {"attempts": -1}), "attempts is not 0..FFFFFFFFh")
    for call, text in ((lambda: typed.lss_switch_selective((1, 2, 3, 4)), "address is an LssAddress, not tuple"),
                       (lambda: typed.create_object({"index": 0x2000}), "described is a ListedObject, not dict")):
        expect("a structure", str(raised(TypeError, call)), text)
    expect("the code", raised(linegate.Error, lambda: typed.boot(8, attempts=-1)).code, -6)
    expect("timeout", str(raised(TypeError, lambda: typed.boot(timeout="1"))), "timeout is a number of seconds, not str")


def test(folder, build, _linegated):
    installed = Installed(build, folder)
    os.environ["LINEGATE_CLIENT_LIBRARY"] = installed.so_file
    sys.path.insert(0, installed.python)
    import linegate  # pylint: disable=import-outside-toplevel,import-error

    with linegate.Client() as client:
        line = client.line("press")
        values = examples(linegate)
        for name, function, numbers, required in commands(linegate, line):
            arguments = {one: values[one] for one in required}
            if "table" in arguments:
                arguments["index"] = 0  # in that table
            for number in numbers:
                check(linegate, name, function, number, arguments)
        expect("no node-ID of LSS", linegate.commands.Commands(line).lss_set_node_id(255, **LONG).outcome,
               linegate.Outcome.PENDING)
        structs(linegate, line)


if __name__ == "__main__":
    run_test(test, own_network=True)
