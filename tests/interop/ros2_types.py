#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Types of C for Cyclone DDS from the message package that `linegate idl --ros2` writes. ROS 2's own rosidl reads the
messages, which also checks their names, and makes IDL of them; its catkin_pkg reads package.xml.

ros2_types.py LINEGATE PLANT LINE IDLC FOLDER
"""

import os
import pathlib
import shutil
import subprocess
import sys

from catkin_pkg.package import parse_package
from rosidl_adapter.msg import convert_msg_to_idl

PACKAGE = "linegate_plant"


def main(linegate, plant, line, idlc, folder):
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # rosidl names each file
    package = pathlib.Path(folder, "package")
    made = pathlib.Path(folder, PACKAGE, "msg")
    shutil.rmtree(package, ignore_errors=True)
    made.mkdir(parents=True, exist_ok=True)
    subprocess.run([linegate, "idl", plant, line, "--ros2", package], check=True, timeout=60)
    if parse_package(package / "package.xml").name != PACKAGE:
        sys.exit(f"the package is not called {PACKAGE}")
    for message in sorted(package.glob("msg/*.msg")):
        convert_msg_to_idl(package, PACKAGE, message.relative_to(package), made)
    # idlc does not know the annotation that has the comments, and says so for each.
    for idl in sorted(made.glob("*.idl")):
        out = subprocess.run([idlc, "-l", "c", "-t", "-I", folder, f"{PACKAGE}/msg/{idl.name}"], cwd=folder, check=False,
                             timeout=60, capture_output=True, text=True)
        if out.returncode != 0:
            sys.exit(out.stderr)
        for kind in ("c", "h"):
            os.replace(pathlib.Path(folder, f"{idl.stem}.{kind}"), made / f"{idl.stem}.{kind}")


if __name__ == "__main__":
    main(*sys.argv[1:6])
