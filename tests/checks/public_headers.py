#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""The headers that the library installs (LINEGATE_PUBLIC_HEADERS of stack/CMakeLists.txt) exist, and include only
installed headers of stack/. Each includes the headers of the standard library that it uses, itself or by another
header of stack/; the build, which compiles each alone (tests/deploy), may have read those before. The guide of the
library (deploy/library/README.md) shows its examples exactly as compiled."""

import os
import re

import tree

LIST = "stack/CMakeLists.txt"
HEADERS = re.compile(r"set\(LINEGATE_PUBLIC_HEADERS\s+([^)]*)\)")
INCLUDE = re.compile(r'^#include "(stack/[^"]+)"', re.MULTILINE)
STANDARD_INCLUDE = re.compile(r"^#include <([^>]+)>", re.MULTILINE)

# The names of the standard library that the headers use, by its headers. Of a namespace, as std::chrono, its name.
NAMES = {
    "algorithm": "any_of all_of copy_n min max ranges::lower_bound ranges::find ranges::any_of ranges::all_of",
    "array": "array",
    "bit": "bit_cast countl_zero countr_zero endian popcount",
    "chrono": "chrono",
    "compare": "strong_ordering <=>",
    "concepts": "integral signed_integral unsigned_integral same_as",
    "cstddef": "byte nullptr_t ptrdiff_t size_t to_integer",
    "cstdint": "int8_t int16_t int32_t int64_t uint8_t uint16_t uint32_t uint64_t",
    "cstring": "memcmp memcpy memset",
    "deque": "deque",
    "functional": "function",
    "initializer_list": "initializer_list",
    "limits": "numeric_limits",
    "map": "map",
    "memory": "make_unique shared_ptr unique_ptr",
    "optional": "nullopt optional",
    "set": "set",
    "span": "span",
    "string": "string to_string",
    "string_view": "string_view",
    "tuple": "tie tuple",
    "type_traits": "conditional_t enable_if_t is_enum_v is_integral_v is_signed_v is_trivially_copyable_v type_identity"
                   " underlying_type_t",
    "unordered_map": "unordered_map",
    "utility": "exchange forward move pair swap",
    "variant": "get get_if monostate variant variant_size_v visit",
    "vector": "erase erase_if vector",
}
HEADER_OF = {name: header for header, names in NAMES.items() for name in names.split()}
USED = re.compile(r"\bstd::((?:ranges::)?\w+)|(<=>)")
COMMENT = re.compile(r"//.*")

GUIDE = "deploy/library/README.md"
EXAMPLE = re.compile(r"^`(\w+\.cpp)`:\n\n```cpp\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def public_headers(root):
    match = HEADERS.search(tree.read(root, LIST))
    return [f"stack/{name}" for name in match[1].split()] if match else []


def check_headers(root):
    public = public_headers(root)
    if not public:
        yield f"{LIST}: no list LINEGATE_PUBLIC_HEADERS"
    for header in public:
        if not os.path.exists(os.path.join(root, header)):
            yield f"{LIST}: {header} does not exist"
            continue
        for included in INCLUDE.findall(tree.read(root, header)):
            if included not in public:
                yield f"{header}: includes {included}, which {LIST} does not install"


def standard_headers(root, header, seen):
    """Returns the headers of the standard library that a header includes, itself or by others of stack/."""
    if header in seen or not os.path.exists(os.path.join(root, header)):
        return set()
    seen.add(header)
    text = tree.read(root, header)
    found = set(STANDARD_INCLUDE.findall(text))
    for included in INCLUDE.findall(text):
        found |= standard_headers(root, included, seen)
    return found


def check_standard_headers(root):
    for header in public_headers(root):
        included = standard_headers(root, header, set())
        for number, line in tree.lines(root, header) if os.path.exists(os.path.join(root, header)) else ():
            for name, operator in USED.findall(COMMENT.sub("", line)):
                name = name or operator
                needed = HEADER_OF.get(name)
                if needed is None:
                    yield f"{header}:{number}: {name} has no header in NAMES of tests/checks/public_headers.py"
                elif needed not in included:
                    yield f"{header}:{number}: uses {name}, but does not include <{needed}>"


def check_examples(root):
    folder = os.path.dirname(GUIDE)
    shown = dict(EXAMPLE.findall(tree.read(root, GUIDE)))
    for path in tree.files(root, (".cpp",)):
        name = os.path.basename(path)
        if os.path.dirname(path) == folder and shown.pop(name, None) != tree.read(root, path):
            yield f"{GUIDE}: does not show {name} as it is"
    for name in shown:
        yield f"{GUIDE}: shows {name}, which does not exist"


def check(root):
    yield from check_headers(root)
    yield from check_standard_headers(root)
    yield from check_examples(root)


if __name__ == "__main__":
    tree.run(check)
