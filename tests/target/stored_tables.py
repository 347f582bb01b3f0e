#!/usr/bin/env python3
"""The firmware on an emulated board keeps its table: round trips of save and read, and power cuts during a save.

  stored_tables.py BOARD IMAGE [TRIPS [CUTS]]    default: 200 and 50

A file backs the board's memory, so the storage outlives QEMU. A debugger's watchpoint on the storage stops the board after
each byte that is written there. A cut kills QEMU after one of these bytes. Two thirds of the cuts lie evenly over a whole save,
the others after each of its last bytes, where the record is completed. 77: no QEMU.
"""
import os
import re
import shutil
import socket
import struct
import subprocess
import sys
import tempfile
import time
import zlib

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "readme"))
from firmware_session import Line, Refused, halves  # noqa: E402

MEMORY = 16 << 20  # of the board's PSRAM
STORAGE = {"mps2-an386": 0x21000000, "mps2-an500": 0x60000000}  # NOR of the linker scripts, where the PSRAM begins
SECTORS = 8 * 4096
UNLOCK, OPEN, CHECK, SAVE = 0x6B6C6E75, 0x6E65706F, 0x6B656863, 0x65766173
BLANK, TOO_SOON = 33, 20  # Status
HIDDEN = 32  # bytes of a save that the debugger may miss, because a tick comes between a stop and its step
BODY = 11  # numbers of a link; the last is its rotor


class Board:
    """One start of the emulated board; leaving the block is a power cut."""

    def __init__(self, board, image, memory, debugger=None, options=()):
        words = ["qemu-system-arm", "-M", f"{board},memory-backend=psram", "-m", f"{MEMORY >> 20}M"]
        words += ["-object", f"memory-backend-file,id=psram,size={MEMORY},mem-path={memory},share=on"]
        words += ["-display", "none", "-monitor", "none", "-serial", "null", "-serial", "pty", "-kernel", image, *options]
        if debugger:
            words += ["-gdb", f"unix:{debugger},server=on,wait=off"]
        self.qemu = subprocess.Popen(words, stdout=subprocess.PIPE, text=True)
        self.line = Line(re.search(r"/dev/\S+", self.qemu.stdout.readline()).group())

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.qemu.kill()
        self.qemu.wait()
        os.close(self.line.file)

    def table(self):
        size = self.line.read(4, 0x0000, 20)[19]
        return self.line.read(3, 0x2000, size)

    def send(self, table):
        """All of a save but the command that begins it. Returns that command's words."""
        line, count, crc = self.line, len(table), zlib.crc32(packed(table))
        schema = table[0] << 16 | table[1]
        sequence = line.u32(0x004A)
        line.write(0x0040, halves(UNLOCK))
        line.write(0x0000, halves(sequence + 1, OPEN, schema) + [count, 0] + halves(0))
        for first in range(0, count, 120):
            line.write(0x1000 + first, table[first : first + 120])
        line.write(0x0000, halves(sequence + 2, CHECK, schema) + [count, 0] + halves(crc))
        return halves(sequence + 3, SAVE, schema) + [count, 0] + halves(crc)

    def save(self, table):
        command = self.send(table)
        while True:
            try:
                self.line.write(0x0000, command)
                break
            except Refused:
                assert self.line.read(4, 0x0041, 1) == [TOO_SOON]  # the board limits the rate, for the flash's sake
                time.sleep(0.1)
        while (state := self.line.read(4, 0x0040, 1)[0]) == 4:
            pass
        assert state == 5, f"transaction state {state}, status {self.line.read(4, 0x0041, 1)[0]}"


class Debugger:
    """Speaks GDB's remote protocol to QEMU."""

    def __init__(self, path, storage):
        self.storage = storage
        self.socket = socket.socket(socket.AF_UNIX)
        self.socket.settimeout(60)
        self.socket.connect(path)
        self.data = b""

    def send(self, text):
        self.socket.sendall(b"$%s#%02x" % (text, sum(text) & 0xFF))

    def answer(self):
        while not (found := re.search(rb"\$([^#]*)#..", self.data)):
            self.data += self.socket.recv(4096)
        self.data = self.data[found.end() :]
        self.socket.sendall(b"+")
        return found.group(1)

    def ask(self, text):
        self.send(text)
        return self.answer()

    def stop(self):
        self.socket.sendall(b"\x03")
        return self.answer()

    def run_through_write(self):
        """QEMU stops before the byte is written, so one step without the watchpoint writes it."""
        answer = self.ask(b"c")
        assert answer.startswith(b"T05"), answer
        self.watch(False)
        self.ask(b"s")
        self.watch(True)

    def watch(self, on):
        command = b"%s2,%x,%x" % (b"Z" if on else b"z", self.storage, SECTORS)
        assert self.ask(command) == b"OK", "no watchpoint"


def blank_memory(folder, storage_bytes=SECTORS):
    memory = os.path.join(folder, "psram")
    with open(memory, "wb") as file:
        file.write(b"\xff" * storage_bytes)
        file.truncate(MEMORY)
    return memory


def packed(table):
    return struct.pack(f">{len(table)}H", *table)


def variant(table, number):
    """The same arm with all bodies heavier by a small share, and noisier: nearly every number differs."""
    out = list(table)
    joints = table[3]
    share = 1 + 1e-3 * (1 + number)
    scaled = [16 + 8 * j for j in range(joints)]
    scaled += [16 + 8 * joints + 8 * k for k in range(BODY * joints) if k % BODY != BODY - 1]
    for word in scaled:
        (value,) = struct.unpack(">f", struct.pack(">2H", *out[word : word + 2]))
        out[word : word + 2] = struct.unpack(">2H", struct.pack(">f", value * share))
    out[5] |= 1  # bumpless, because the board's axes are always enabled
    out[7] = 500
    return out


def round_trips(board, image, memory, trips):
    with Board(board, image, memory) as b:
        assert b.line.read(4, 0x0042, 1) == [BLANK], "the first boot of an empty storage"
        default = b.table()
        for k in range(trips):
            sent = variant(default, k)
            b.save(sent)
            assert b.table() == sent, f"round trip {k}"
            assert b.line.u32(0x0048) == zlib.crc32(packed(sent)), f"round trip {k}: active_crc"
    print(f"{trips} of {trips} round trips")
    return default


def in_force(board, image, memory):
    with Board(board, image, memory) as b:
        assert b.line.read(4, 0x0042, 1) == [0], "no valid table after a power cut"
        table = b.table()
        assert b.line.u32(0x0048) == zlib.crc32(packed(table)), "active_crc after a power cut"
        return table


def written_bytes(board, image, memory, folder, table, most):
    """Saves up to this many bytes written to the storage, then cuts the power. most = None: counts them to the end."""
    path = os.path.join(folder, "gdb")
    with Board(board, image, memory, path) as b:
        command = b.send(table)
        debugger = Debugger(path, STORAGE[board])
        debugger.stop()
        debugger.watch(True)
        b.line.post(struct.pack(f">BHHB{len(command)}H", 16, 0, len(command), 2 * len(command), *command))
        count = 0
        while most is None or count < most:
            try:
                debugger.run_through_write()
            except socket.timeout:
                break
            count += 1
            debugger.socket.settimeout(30)  # on a busy machine QEMU is silent for seconds; the save has ended if it is for longer
        return count


def cuts(board, image, memory, folder, default, number):
    total = written_bytes(board, image, memory, folder, variant(default, 500), None)
    assert in_force(board, image, memory) == variant(default, 500), "a save that was only watched"
    assert total > 2 * len(default), f"a save writes more than {total} bytes"
    old = variant(default, 500)
    kept = changed = torn = 0
    at_end = number // 3
    even = number - at_end
    places = [1 + (total - at_end - 1) * k // even for k in range(even)] + [total - k for k in reversed(range(at_end))]
    for k, place in enumerate(places):
        new = variant(default, 501 + k)
        done = written_bytes(board, image, memory, folder, new, place)
        assert done >= place - HIDDEN, f"the save ended after {done} bytes"
        now = in_force(board, image, memory)
        kept, changed, torn = kept + (now == old), changed + (now == new), torn + (now not in (old, new))
        print(f"cut after byte {done} of {total}: {'old' if now == old else 'new' if now == new else 'TORN'}", flush=True)
        old = now
    print(f"{number} cuts: {kept} old, {changed} new, {torn} torn")
    assert torn == 0
    assert kept > 0 and changed > 0, "the cuts do not lie on both sides of the commit"


def main():
    board, image = sys.argv[1:3]
    trips, number = [int(word) for word in sys.argv[3:5]] + [200, 50][len(sys.argv) - 3 :]
    if shutil.which("qemu-system-arm") is None:
        print("skipped: no qemu-system-arm (toolchains/install.sh cross)")
        return 77
    with tempfile.TemporaryDirectory() as folder:
        memory = blank_memory(folder)
        default = round_trips(board, image, memory, trips)
        cuts(board, image, memory, folder, default, number)
    return 0


if __name__ == "__main__":
    sys.exit(main())
