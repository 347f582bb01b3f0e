#!/usr/bin/env python3
"""Runs the README's firmware on an emulated board and talks Modbus RTU to it over its serial line.

  firmware_session.py BOARD IMAGE TOOL

The client is written from the Modbus specification and SPEC.md, not from armcal; at the end the armcal tool, if it has
been built, asks over the same line. 77: no QEMU here.
"""
import math
import os
import re
import select
import shutil
import struct
import subprocess
import sys
import tempfile
import termios
import time
import tty
import zlib

SECONDS = 60  # for anything to come true: an emulated board shares its processor with others
REPLY_SECONDS = 2  # then the master asks again, as Modbus wants it: a pause inside a frame drops it


def crc16(data):
    crc = 0xFFFF
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = (crc >> 1) ^ (0xA001 if crc & 1 else 0)
    return struct.pack("<H", crc)


class Refused(Exception):
    """The drive answered with this exception code."""


class NoReply(Exception):
    """What came, if anything, is no whole frame."""


class Line:
    """Address 1 on a serial line; one request, one reply."""

    def __init__(self, path):
        self.file = os.open(path, os.O_RDWR | os.O_NOCTTY)
        tty.setraw(self.file)

    def take(self, count, deadline):
        data = b""
        while len(data) < count:
            if not select.select([self.file], [], [], max(0.0, deadline - time.monotonic()))[0]:
                raise NoReply(f"{len(data)} of {count} bytes")
            data += os.read(self.file, count - len(data))
        return data

    def post(self, pdu):
        frame = b"\x01" + pdu
        termios.tcflush(self.file, termios.TCIFLUSH)
        os.write(self.file, frame + crc16(frame))

    def ask_once(self, pdu):
        self.post(pdu)
        deadline = time.monotonic() + REPLY_SECONDS
        reply = self.take(3, deadline)
        if reply[1] & 0x80:
            reply += self.take(2, deadline)
        else:
            reply += self.take(reply[2] + 2 if reply[1] in (3, 4) else 5, deadline)
        if crc16(reply[:-2]) != reply[-2:]:
            raise NoReply(f"checksum of {reply.hex()}")
        if reply[1] & 0x80:
            raise Refused(reply[2])
        return reply[2:-2]

    def drain(self):
        """A late reply must not be taken for the next one."""
        while select.select([self.file], [], [], 1.0)[0]:
            os.read(self.file, 4096)

    def ask(self, pdu):
        deadline = time.monotonic() + SECONDS
        while True:
            try:
                return self.ask_once(pdu)
            except NoReply as missing:
                if time.monotonic() > deadline:
                    raise SystemExit(f"no reply to {pdu[:5].hex()}: {missing}")
                print(f"asking {pdu[:5].hex()} again: {missing}")
                self.drain()

    def read(self, function, first, count):
        words = []
        while len(words) < count:
            part = min(120, count - len(words))
            reply = self.ask(struct.pack(">BHH", function, first + len(words), part))
            words += struct.unpack(f">{part}H", reply[1:])
        return words

    def write(self, first, words):
        self.ask(struct.pack(f">BHHB{len(words)}H", 16, first, len(words), 2 * len(words), *words))

    def u32(self, address):
        high, low = self.read(4, address, 2)
        return high << 16 | low

    def floats(self, address, count):
        return struct.unpack(f">{count}f", struct.pack(f">{2 * count}H", *self.read(4, address, 2 * count)))


def until(what, true):
    deadline = time.monotonic() + SECONDS
    while not true():
        if time.monotonic() > deadline:
            raise SystemExit(f"after {SECONDS} s still not: {what}")
        time.sleep(0.05)
    print(what)


def halves(*numbers):
    return [half for number in numbers for half in (number >> 16, number & 0xFFFF)]


def session(line):
    identity = line.read(4, 0x0000, 26)
    assert struct.pack(">2H", *identity[0:2]) == b"ARMC", identity
    assert struct.pack(">2H", *identity[12:14]) == struct.pack(">f", 123456.789), "word order"
    schema, axes, columns, size = identity[6] << 16 | identity[7], identity[16], identity[18], identity[19]

    until("the tick counts, and filter A has used rows", lambda: line.u32(0x0046) > 0 and line.u32(0x0060) > 0)
    values = line.floats(0x0100, columns) + line.floats(0x0300, columns)
    assert all(map(math.isfinite, values)) and min(values[columns:]) >= 0.0, values
    assert line.read(4, 0x0043, 1) == [0], "feed-forward without a table"

    # A table, as SPEC.md says: unlock, open, words, check, save. All axes are enabled: it must be bumpless, and fade.
    table = line.read(3, 0x2000, size)
    table[5] |= 1
    table[7] = 500
    data = struct.pack(f">{size}H", *table)
    crc, opened, check, save = zlib.crc32(data), 0x6E65706F, 0x6B656863, 0x65766173
    try:
        line.write(0x0000, halves(1, opened, schema) + [size, 0] + halves(0))
        raise SystemExit("a locked drive opened a table transaction")
    except Refused:
        print("locked: refused")
    line.write(0x0040, halves(0x6B6C6E75))
    line.write(0x0000, halves(1, opened, schema) + [size, 0] + halves(0))
    for first in range(0, size, 100):
        line.write(0x1000 + first, table[first : first + 100])
    line.write(0x0000, halves(2, check, schema) + [size, 0] + halves(crc))
    line.write(0x0000, halves(3, save, schema) + [size, 0] + halves(crc))
    until("the table is stored and in force", lambda: line.read(4, 0x0040, 1) == [5])
    until("feed-forward has faded in", lambda: line.read(4, 0x0043, 1) == [1])
    assert line.u32(0x0048) == crc and line.u32(0x0044) == 2, "checksum, generation"

    until("the filter learns again", lambda: line.u32(0x0060) > 0)
    line.write(0x0150, [1])
    line.write(0x0151, [2])
    for unknown in (0, axes + 2):
        try:
            line.write(0x0151, [unknown])
            raise SystemExit(f"reset of block {unknown} was not refused")
        except Refused as refusal:
            assert refusal.args[0] == 3, refusal
    tick = line.u32(0x0046)
    until("two seconds on hold", lambda: line.u32(0x0046) > tick + 2000)
    used, gated = line.u32(0x0060), line.u32(0x0062)
    until("rows are gated", lambda: line.u32(0x0062) > gated)
    assert line.u32(0x0060) == used, "a filter on hold used rows"
    line.write(0x0150, [0])
    until("and used again", lambda: line.u32(0x0060) > used)


def run(expected, *words):
    done = subprocess.run(words, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False)
    print(" ".join(["armcal", *words[1:]]), done.stdout, sep="\n")
    assert done.returncode == expected, done.returncode
    return done.stdout


def with_tool(tool, path):
    if not os.path.exists(tool):
        print(f"{tool} is not built: only our own client was tried")
        return
    drive = ["--connect", path + ":115200:N:1"]
    run(0, tool, "learning", *drive, "--reset", "bodies")
    assert ": on hold" in run(0, tool, "learning", *drive, "--hold")
    run(6, tool, "health", *drive)  # too early to tell
    with tempfile.TemporaryDirectory() as folder:
        log = os.path.join(folder, "log.csv")
        record = [tool, "record", *drive, "--robot", "er20_like", "--out", log]
        assert "plays no trajectories" in run(4, *record, "--trajectory", "any.csv")
        assert "serves no trace of processed samples" in run(4, *record, "--seconds", "5", "--samples", log + ".gz")
        run(0, *record, "--seconds", "5", "--lean")
        with open(log, encoding="utf-8") as file:
            header, *rows = [line.strip().split(",") for line in file if not line.startswith("#")]
        q1 = [float(row[header.index("q1")]) for row in rows]
        # The pretended joint 1 swings by 0.4 rad in 4 s: half a period later it is on the other side.
        assert len(q1) > 600 and abs(max(q1) - 0.4) < 1e-3, (len(q1), max(q1))
        assert max(abs(a + b) for a, b in zip(q1, q1[250:])) < 1e-3


def main():
    board, image, tool = sys.argv[1:]
    if shutil.which("qemu-system-arm") is None:
        print("skipped: no qemu-system-arm (toolchains/install.sh cross)")
        return 77
    command = ["qemu-system-arm", "-M", board, "-display", "none", "-monitor", "none", "-serial", "null", "-serial", "pty"]
    emulator = subprocess.Popen(command + ["-kernel", image], stdout=subprocess.PIPE, text=True)
    try:
        path = re.search(r"/dev/\S+", emulator.stdout.readline()).group()
        session(Line(path))
        with_tool(tool, path)
        assert emulator.poll() is None, "the image ended"
    finally:
        emulator.kill()
        emulator.wait()
    return 0


if __name__ == "__main__":
    sys.exit(main())
