#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# forwarding_in_guest.sh PROGRAM [--short]
#
# Runs in the guest: makes three pairs of vcan interfaces, joins the first by a rule of can-gw, and runs
# measure_forwarding_guest on them. From outside:
#   tests/guest/boot tests/bench/forwarding_in_guest.sh build/release/tests/bench/measure_forwarding_guest
set -eu
program=$1
shift
pairs=(gw0 gw1 loop0 loop1 line0 line1)
for name in "${pairs[@]}"; do
  ip link add "$name" type vcan
  ip link set "$name" up
done
# -e: frames that this machine sent itself, too. SET:I: identifier; length and data as they are.
cangw -A -s gw0 -d gw1 -e -m SET:I:205.0.0000000000000000
"$program" "$@" "${pairs[@]}"
