# SPDX-License-Identifier: Apache-2.0
"""The client library, installed from the build into a folder, and the examples of deploy/client built against it."""

import os
import subprocess

EXAMPLES = os.path.realpath(os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "deploy", "client"))
COMPONENTS = ("client", "client_runtime", "client_python")


def output(*command, **options):
    """The standard output of a command that has to succeed."""
    done = subprocess.run(command, capture_output=True, text=True, check=False, **options)
    if done.returncode != 0:
        raise AssertionError(f"{command} ended with {done.returncode}: {done.stdout}{done.stderr}")
    return done.stdout


def example_plant(folder, more):
    """The plant of the examples with more settings, as a file in that folder."""
    with open(os.path.join(EXAMPLES, "plant.yaml"), encoding="utf-8") as file:
        text = file.read().replace("../../", os.path.join(os.path.dirname(os.path.dirname(EXAMPLES)), ""))
    path = os.path.join(folder, "plant.yaml")
    with open(path, "w", encoding="utf-8") as file:
        file.write(text + more)
    return path


class Installed:
    """The library in the folder `prefix`."""

    def __init__(self, build, folder):
        self.folder, self.prefix = folder, os.path.join(folder, "prefix")
        for component in COMPONENTS:
            output("cmake", "--install", build, "--component", component, "--prefix", self.prefix)
        self.so_file = os.path.join(self.prefix, "lib", "liblinegate-client.so")
        self.include = os.path.join(self.prefix, "include")
        self.python = os.path.join(self.prefix, "lib", "python3", "dist-packages")
        # Programs in another folder than the library, as users have before it is installed to /usr.
        self.environment = {**os.environ, "LD_LIBRARY_PATH": os.path.dirname(self.so_file), "PYTHONPATH": self.python,
                            "PYTHONDONTWRITEBYTECODE": "1"}

    def examples(self):
        """Builds the examples. Returns their commands, by language."""
        build = os.path.join(self.folder, "examples")
        output("cmake", "-S", EXAMPLES, "-B", build, f"-DCMAKE_PREFIX_PATH={self.prefix}",
               "-DCMAKE_CXX_FLAGS=-Wall -Wextra -Werror", "-DCMAKE_C_FLAGS=-Wall -Wextra -Werror -Wno-unused-parameter")
        output("cmake", "--build", build)
        return {"C++": [os.path.join(build, "hold")], "C": [os.path.join(build, "hold_c")],
                "Python": ["/usr/bin/python3", os.path.join(EXAMPLES, "hold.py")]}


def armed(linegate, group):
    """Whether it could be armed."""
    try:
        group.arm()
    except linegate.NotReady:
        return False
    return True
