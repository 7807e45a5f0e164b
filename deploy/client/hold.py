#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Reads two inputs, holds one output and sends one command, whatever becomes of the gateway."""
import asyncio
import linegate


async def main():
    async with linegate.Client() as client:
        client.on_line(lambda now: print(f"{now.line}: {now.status.text}", flush=True))
        press = client.line("press")
        press.on_change(["angle.Position value", "panel.Read input bit.Input 1"],
                        lambda now: print(*now, sep="\n", flush=True))
        lamps = press.group("lamps")
        lamps.on_state(lambda now: print("lamps:", now.text, flush=True))
        while True:  # At the start and after each loss this application decides to hold the lamps again.
            try:
                await lamps.hold({"panel.Write output 8-bit.Outputs 1 to 8": 5})
                print("vendor:", int.from_bytes(await press.sdo_read(8, 0x1018, 1), "little"), flush=True)
                await lamps.ended()
            except (linegate.GroupError, linegate.CallError, linegate.NotReady) as error:
                print(error, flush=True)
                await asyncio.sleep(1)

asyncio.run(main())
