#!/usr/bin/env python3
"""The firmware whose tick lies in RAM goes on while its flash is forbidden, as it is during an erase.

  tick_in_ram.py BOARD IMAGE

Saves tables. Each save erases a sector, and meanwhile the image forbids the flash (port/mps2/flash_guard.hpp). The erase ends
after some ticks only, so a save that ends shows that the tick went on. An access to the flash is a fault, after which the board
is silent; QEMU's log then says which fault. 77: no QEMU.
"""
import os
import re
import shutil
import sys
import tempfile

from stored_tables import BLANK, Board, blank_memory, variant  # first: it knows where firmware_session lies
import firmware_session

firmware_session.REPLY_SECONDS = 0.5  # how soon silence is looked into; the board may still answer later

SAVES = 3


def faults(log):
    with open(log, encoding="utf-8") as file:
        return list(dict.fromkeys(re.findall(r"Taking exception \d+ \[(.*Abort)\]", file.read())))


def saves(board, image, memory, log):
    with Board(board, image, memory, options=["-d", "int", "-D", log]) as b:
        drain = b.line.drain

        def silent():
            if found := faults(log):
                raise SystemExit(f"the board is silent after a fault: {', '.join(found)}")
            drain()

        b.line.drain = silent
        assert b.line.read(4, 0x0042, 1) == [BLANK], "the first boot of an empty storage"
        default = b.table()
        for k in range(SAVES):
            b.save(variant(default, k))
            assert b.table() == variant(default, k), f"save {k}"
    assert not faults(log), faults(log)
    print(f"{SAVES} saves, and the tick went on during each erase")


def main():
    board, image = sys.argv[1:]
    if shutil.which("qemu-system-arm") is None:
        print("skipped: no qemu-system-arm (toolchains/install.sh cross)")
        return 77
    with tempfile.TemporaryDirectory() as folder:
        saves(board, image, blank_memory(folder), os.path.join(folder, "log"))
    return 0


if __name__ == "__main__":
    sys.exit(main())
