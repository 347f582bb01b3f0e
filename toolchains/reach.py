#!/usr/bin/env python3
"""toolchains - what functions of an image reach, code and constants, with sizes: what must not lie in flash while it is erased.

  reach.py --image ELF --map MAP --root REGEX [--root ...] [--pointers FILE] [--script OUT] [--leave-out REGEX] [--within FIRST-LAST]

MAP is the linker's map of ELF (-Wl,-Map). Both are read section by section, as the compiler made them with -ffunction-sections
and -fdata-sections: a section is reached as a whole. A section reaches another one if it branches into it, or if one of its
words is an address in it. A number that looks like such an address counts, too: the list may be too long, and not too short.
Calls through pointers are listed in FILE, a line each: "REGEX of the caller -> REGEX of what it may call", or "none".
Regular expressions search C++ names. Fails on a call through a pointer whose caller FILE does not name.

--script: writes the sections as lines of a linker script, for `INCLUDE` in an output section in RAM. --leave-out: but not these.
--within: fails if something that is reached, or the vector table that the core reads (symbol vectors_in_use), lies elsewhere.
"""
import argparse
import bisect
import re
import subprocess
import sys
from pathlib import Path

PLACED = re.compile(r"^ (\.\S+|COMMON)\s+(?:\n\s+)?0x([0-9a-f]+)\s+0x([0-9a-f]+) (\S.*)$", re.MULTILINE)
HELD = re.compile(r"^\.(text|rodata)(\.|$)")  # what flash holds: code, and constants


class Unlisted(Exception):
    """A call through a pointer that nobody listed; the text says where."""


class Section:
    def __init__(self, name, address, size, file):
        self.name, self.address, self.size, self.file = name, address, size, file
        self.symbols, self.pointer_calls, self.reached = [], [], set()

    @property
    def is_code(self):
        return self.name.startswith(".text")

    def title(self):
        return self.symbols[0] if self.symbols else f"{self.name} of {Path(self.file).name}"

    def pattern(self):
        """For a linker script: this section of this file. A member of an archive is archive:member."""
        member = re.fullmatch(r"(.*)\((.*)\)", self.file)
        file = f"*{Path(member[1]).name}:{member[2]}" if member else f"*{Path(self.file).name}"
        return f"{file}({self.name})"


class Image:
    def __init__(self, elf, linker_map, objdump, nm):
        text = Path(linker_map).read_text(encoding="utf-8").split("Linker script and memory map")[1]
        self.sections = sorted((Section(name, int(address, 16), int(size, 16), file)
                                for name, address, size, file in PLACED.findall(text) if HELD.match(name) and int(size, 16) > 0),
                               key=lambda s: s.address)
        self.starts = [s.address for s in self.sections]
        self.symbols = {}
        for line in self._run(nm, "-C", elf):
            if found := re.match(r"([0-9a-f]+) (\w) (.*)", line):
                self.symbols[found[3]] = int(found[1], 16)
                if (section := self.at(int(found[1], 16))) and found[2] in "tTwWrRvVdD" and found[3] not in section.symbols:
                    section.symbols.append(found[3])
        self._read_code(self._run(objdump, "-d", "-C", "--no-show-raw-insn", elf))
        self._read_constants(self._run(objdump, "-s", elf))

    @staticmethod
    def _run(*command):
        return subprocess.run(command, check=True, capture_output=True, text=True).stdout.splitlines()

    def at(self, address):
        k = bisect.bisect_right(self.starts, address) - 1
        if k < 0 or address >= self.sections[k].address + self.sections[k].size:
            return None
        return self.sections[k]

    def _refer(self, section, value):
        """A word: the address of a function is odd and its first one; one of a constant may lie inside."""
        other = self.at(value & ~1)
        if other is None or other is section:
            return
        if not other.is_code or value & 1 and any(self.symbols[name] | 1 == value for name in other.symbols):
            section.reached.add(other)

    def _read_code(self, lines):
        upper = {}
        for line in lines:
            found = re.match(r"\s*([0-9a-f]+):\t(\S+)\t?([^;]*)", line)
            if not found or (section := self.at(int(found[1], 16))) is None or not section.is_code:
                continue
            name, operands = found[2], found[3]
            if name == ".word":
                self._refer(section, int(operands.split()[0], 16))
            elif name.startswith("movw"):
                register, number = re.match(r"(\w+), #(\d+)", operands).groups()
                upper[register] = int(number)
            elif name.startswith("movt"):
                register, number = re.match(r"(\w+), #(\d+)", operands).groups()
                self._refer(section, int(number) << 16 | upper.get(register, 0))
            elif re.match(r"blx?(\.w)?$", name) and re.match(r"(r\d+|ip|sl|fp|lr)\b", operands):
                section.pointer_calls.append(int(found[1], 16))
            elif re.match(r"bx$", name) and not operands.startswith("lr"):
                section.pointer_calls.append(int(found[1], 16))
            elif re.match(r"(b|cb)", name) and (target := re.search(r"\b([0-9a-f]+) <", operands)):
                other = self.at(int(target[1], 16))
                if other is not None and other is not section:
                    section.reached.add(other)

    def _read_constants(self, lines):
        data = {}
        for line in lines:
            if found := re.match(r" ([0-9a-f]+) ((?:[0-9a-f]{2,8} ){1,4})", line):
                raw = bytes.fromhex(found[2].replace(" ", ""))
                for k in range(0, len(raw) - 3, 4):
                    data[int(found[1], 16) + k] = int.from_bytes(raw[k : k + 4], "little")
        for section in self.sections:
            if not section.is_code:
                for address in range(section.address, section.address + section.size - 3, 4):
                    self._refer(section, data.get(address, 0))

    def named(self, pattern):
        return [s for s in self.sections if s.is_code and s.file != "linker stubs" and any(re.search(pattern, name) for name in s.symbols)]

    def reach(self, roots, pointers):
        """Sections that `roots` reach, themselves among them, by address."""
        found, open_ = set(), []
        for root in roots:
            if not self.named(root):
                raise Unlisted(f"no function is called like '{root}'")
            open_ += self.named(root)
        while open_:
            section = open_.pop()
            if section in found:
                continue
            found.add(section)
            open_ += section.reached
            if section.pointer_calls:
                listed = [callee for caller, callee in pointers if any(re.search(caller, name) for name in section.symbols)]
                if not listed:
                    raise Unlisted(f"call through a pointer: {section.title()}, at {section.pointer_calls[0]:x}")
                for callee in listed:
                    if callee != "none":
                        open_ += self.named(callee)
        return sorted(found, key=lambda s: s.address)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name in ["image", "map"]:
        parser.add_argument("--" + name, required=True)
    parser.add_argument("--root", action="append", required=True)
    for name in ["pointers", "script", "leave-out", "within"]:
        parser.add_argument("--" + name)
    parser.add_argument("--objdump", default="arm-none-eabi-objdump")
    parser.add_argument("--nm", default="arm-none-eabi-nm")
    options = parser.parse_args()
    pointers = []
    if options.pointers:
        lines = [line.split("#")[0].strip() for line in Path(options.pointers).read_text(encoding="utf-8").splitlines()]
        pointers = [tuple(part.strip() for part in line.split("->")) for line in lines if line]
    image = Image(options.image, options.map, options.objdump, options.nm)
    try:
        found = image.reach(options.root, pointers)
    except Unlisted as why:
        print(why)
        return 1
    for section in found:
        print(f"{section.address:08x} {section.size:6} {'code' if section.is_code else 'constants':10}{section.title()[:120]}")
    code = sum(s.size for s in found if s.is_code)
    print(f"{len(found)} sections, {code} bytes of code and {sum(s.size for s in found) - code} bytes of constants")
    if options.script:
        left = re.compile(options.leave_out) if options.leave_out else None
        lines = [s.pattern() for s in found if left is None or not any(left.search(name) for name in s.symbols)]
        Path(options.script).write_text("\n".join(dict.fromkeys(lines)) + "\n", encoding="utf-8")
    failed = False
    if options.within:
        first, last = (int(part, 16) for part in options.within.split("-"))
        outside = [(s.address, s.title()) for s in found if not first <= s.address < last]
        if not first <= image.symbols.get("vectors_in_use", -1) < last:
            outside.append((image.symbols.get("vectors_in_use", 0), "the vector table that the core reads"))
        for address, title in outside:
            print(f"not in {options.within}: {address:08x} {title}")
        failed = bool(outside)
    return int(failed)


if __name__ == "__main__":
    sys.exit(main())
