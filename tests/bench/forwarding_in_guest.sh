#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# forwarding_in_guest.sh PROGRAM [--short]
#
# Runs in the guest: creates three pairs of vcan interfaces, connects the first pair by a rule of can-gw, and runs
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
# -e: includes frames that this machine sent itself. SET:I: sets the identifier, keeps length and data.
cangw -A -s gw0 -d gw1 -e -m SET:I:205.0.0000000000000000
"$program" "$@" "${pairs[@]}"
