#!/usr/bin/env python3
"""The firmware on a memory whose sectors take two seconds to erase: a save loses no sample and no tick.

  slow_sectors.py BOARD IMAGE

Saves tables. Reads during each save how many rows the filter has used and how many samples were lost. The board counts
rows about once a second. On a busy computer it may do so after the erase alone, so not each save shows rows. 77: no QEMU.
"""
import shutil
import sys
import tempfile

from stored_tables import BLANK, Board, blank_memory, halves, variant

SHOWN, MOST_SAVES, STORAGE_BYTES = 2, 20, 2 * 128 * 1024
ERASE_TICKS, COMMITTING, ACTIVE = 2000, 4, 5
TICK, SAMPLE_GAPS, ROWS_USED, STATE = 0x0046, 0x0054, 0x0060, 0x0040


def save(b, table):
    """Answers how many ticks the save took, and how many rows were used before the erase can have ended."""
    command = b.send(table)
    begin, rows = b.line.u32(TICK), b.line.u32(ROWS_USED)
    b.line.write(0x0000, command)
    used = 0
    while (state := b.line.read(4, STATE, 1)[0]) == COMMITTING:
        if (now := b.line.u32(TICK)) - begin < ERASE_TICKS:
            used = b.line.u32(ROWS_USED) - rows
    assert state == ACTIVE, f"transaction state {state}, status {b.line.read(4, STATE + 1, 1)[0]}"
    return b.line.u32(TICK) - begin, used


def main():
    board, image = sys.argv[1:]
    if shutil.which("qemu-system-arm") is None:
        print("skipped: no qemu-system-arm (toolchains/install.sh cross)")
        return 77
    with tempfile.TemporaryDirectory() as folder, Board(board, image, blank_memory(folder, STORAGE_BYTES)) as b:
        assert b.line.read(4, 0x0042, 1) == [BLANK], "the first boot of an empty storage"
        default = b.table()
        shown = 0
        for k in range(MOST_SAVES):
            ticks, used = save(b, variant(default, k))
            assert b.table() == variant(default, k), f"save {k}"
            assert ticks >= ERASE_TICKS, f"save {k} took {ticks} ticks"
            lost = b.line.u32(SAMPLE_GAPS)
            assert lost == 0, f"save {k}: {lost} samples lost"
            print(f"save {k}: {ticks} ticks, {used} rows used meanwhile, no sample lost")
            shown += used > 0
            if shown == SHOWN:
                break
        assert shown == SHOWN, f"{shown} of {MOST_SAVES} saves showed a row that was used meanwhile"
    return 0


if __name__ == "__main__":
    sys.exit(main())
