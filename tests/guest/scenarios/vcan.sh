#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# The guest itself: another process receives the frames sent on its interfaces, byte for byte, and a classical interface
# rejects an FD frame. If this fails, the results of all other scenarios are meaningless.
set -u

expect_frame() {  # INTERFACE FRAME (as cansend writes it) LINE (as candump -L writes it, without time)
  local seen=$TMPDIR/seen.$1
  candump -L -n 1 -T 2000 "$1" >"$seen" &
  local witness=$!
  until grep -q "^ *$1 " /proc/net/can/rcvlist_all; do sleep 0.02; done
  cansend "$1" "$2" || exit 1
  wait $witness
  if [[ $(cut -d' ' -f2- "$seen") != "$3" ]]; then
    echo "$1: sent $2, expected '$3', seen '$(<"$seen")'"
    exit 1
  fi
  echo "$1: $2 seen"
}

expect_frame vcan0 181#0102030405060708 "vcan0 181#0102030405060708"
expect_frame vcan2 000#8105 "vcan2 000#8105"
expect_frame vcan0 701#R "vcan0 701#R"
# The kernel adds the flag FDF (4) to BRS (1).
expect_frame vcan1 181##100112233445566778899AABB "vcan1 181##500112233445566778899AABB"

if cansend vcan0 181##100112233445566778899AABB &>/dev/null; then
  echo "vcan0 took an FD frame"
  exit 1
fi
