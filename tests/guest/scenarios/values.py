#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Values in both directions: values that a device sends arrive byte for byte at a subscriber, and values that a
subscriber writes arrive in the device's RPDO; for a subscriber with Fast DDS and one with Cyclone DDS. Also SDO
reads from a subscriber's process, one of which the device aborts."""

from actors import check, eventually, play, send
from plant import Plant, all_valid, by_name
from subscribers import same_events, same_images

# The bytes of a line's input image that come from each PDO (`linegate check plant.yaml` prints them), and a byte that
# changes by itself.
PDOS = {
    "press": {0x185: (0, 3), 0x285: (4, 8), 0x187: (12, 6), 0x287: (20, 4)},
    "hall": {0x28A: (0, 8), 0x38A: (8, 8), 0x18C: (16, 4), 0x28C: (20, 1)},
    "pack": {0x194: (0, 3), 0x294: (4, 8), 0x196: (12, 4), 0x296: (16, 1)},
}
MOVING = {"press": 0x187, "hall": 0x28A, "pack": 0x196}
OUTPUTS = "doors.Write output 8-bit.Outputs "
WRITTEN_BITS = ("1 to 8", "9 to 16")
WRITTEN = [(True, "A5"), (True, "5A")]


def part(image, line, identifier):
    offset, length = PDOS[line][identifier]
    return bytes.fromhex(image["bytes"])[offset : offset + length]


def every_pdo_is_one_from_the_bus(plant, line, image):
    for identifier in PDOS[line]:
        plant.bus[line].await_frame(identifier, part(image, line, identifier))  # a complete frame of it


def values_arrive(plant, subscriber):
    for line, moving in MOVING.items():
        first = eventually(
            f"{line}: {subscriber.name} has an image of valid values",
            lambda: [image for image in subscriber.images(line) if all_valid(image)],
        )[0]
        every_pdo_is_one_from_the_bus(plant, line, first)
        before = part(first, line, moving)
        other = eventually(
            f"{line}: {moving:X}h brings {subscriber.name} another value",
            lambda: [
                image
                for image in subscriber.images(line)
                if all_valid(image) and part(image, line, moving) != before
            ],
        )[0]
        every_pdo_is_one_from_the_bus(plant, line, other)


def a_value_chosen_here_arrives(plant):
    """The device is stopped, and cansend sends in its place before its heartbeat time has passed."""
    plant.devices["hall"].kill()
    send("vcan1", "18C#A1B2C3D4")
    for subscriber in plant.subscribers:
        image = eventually(
            f"hall: A1 B2 C3 D4 from cansend is in the image of {subscriber.name}",
            lambda: [i for i in subscriber.images("hall") if part(i, "hall", 0x18C).hex() == "a1b2c3d4"],
        )[0]
        entry = by_name(image)["doors.Read input 8-bit.Inputs 17 to 24"]
        check("hall: and C3 is the value of its entry", entry["bytes"] == "C3")


def outputs_arrive(plant):
    def sent():
        return [data for _, _, data in plant.bus["hall"].frames(0x20C)]

    plant.held_back("write", "hall", OUTPUTS + "1 to 8", "0xA5")
    check("hall: an RPDO with an output that nobody chose is held back", sent() == [])
    plant.command("write", "hall", OUTPUTS + "9 to 16", "0x5A")
    eventually("hall: both outputs are in the device's RPDO", lambda: sent()[-1:] == [b"\xa5\x5a"])
    for sub, value in (("1", "A5"), ("2", "5A")):
        answer = plant.command("sdo", "read", "hall:12", "6200", sub, "u8")
        check(f"hall: the device has {value} in 6200h:{sub}", answer["data"] == value)


def outputs_are_read_back(plant):
    image = eventually(
        "hall: both outputs are in the output image that Cyclone DDS receives",
        lambda: [i for i in plant.stranger.images("hall", "outputs") if written(i) == WRITTEN],
    )[-1]
    answer = plant.command("image", "--outputs", "hall")
    check("hall: and in that of Fast DDS, every byte the same", answer["bytes"] == image["bytes"])
    check("hall: by their names too", written(answer) == WRITTEN)


def written(image):
    entries = by_name(image)
    return [(entries[OUTPUTS + bits]["valid"], entries[OUTPUTS + bits]["bytes"]) for bits in WRITTEN_BITS]


def outputs_are_refused(plant):
    said = plant.refused("write", "pack", "valves.Write output 8-bit.Outputs 1 to 8", "1")
    check(f"pack: a line without access refuses: {said.strip()}", "access" in said or "permit" in said)
    check("pack: and nothing was sent", plant.bus["pack"].frames(0x216) == [])


def objects_are_read(plant):
    answers = plant.bus["hall"]
    answer = plant.command("sdo", "read", "hall:12", "1000", "0", "u32")
    answers.await_frame(0x58C, bytes.fromhex("43001000" + answer["data"]))
    said = plant.refused("sdo", "read", "hall:12", "2FFF", "0")
    words = "object does not exist in the object dictionary"
    check("hall: a wrong object gives the abort code in words", words in said)
    answers.await_frame(0x58C, bytes.fromhex("80ff2f0000000206"))


def scenario():
    plant = Plant()
    for subscriber in plant.subscribers:
        values_arrive(plant, subscriber)
    outputs_arrive(plant)
    outputs_are_read_back(plant)
    outputs_are_refused(plant)
    objects_are_read(plant)
    for line in MOVING:
        same_images(line, *plant.subscribers)
    a_value_chosen_here_arrives(plant)
    plant.stop()
    for line in MOVING:
        same_events(line, *plant.subscribers)


play(scenario)
