#!/usr/bin/env python3
"""toolchains - how deep the stack can get below given functions, from what GCC writes with -fcallgraph-info=su.

  stack.py --root REGEX [--root ...] --limit BYTES [--indirect FILE] OBJECT ...

OBJECT: compiled with that option, so that a .ci file lies beside it. Prints each root's bound and the path that needs it.
Fails on recursion, on a frame whose size depends on data, on a call through a pointer whose targets nobody listed, on a
function whose stack is unknown, and on a bound above the limit. FILE lists calls through pointers, a line each: "source
file that makes the call -> REGEX of what it may call", or "none". Regular expressions search the function's C++ name.
"""
import argparse
import re
import sys
from pathlib import Path

# Stack of the C library's own functions, bytes (newlib for Thumb-2: what they push).
LIBRARY = {"memcpy": 0, "memset": 12, "memcmp": 16}
NODE = re.compile(r'node: \{ title: "([^"]*)" label: "([^"]*)"')
EDGE = re.compile(r'edge: \{ sourcename: "([^"]*)" targetname: "([^"]*)"(?: label: "([^"]*)")?')
USAGE = re.compile(r"\\n(\d+) bytes \(([a-z,]+)\)")


class Unbounded(Exception):
    """No bound can be given; the text says why."""


class Calls:
    """The calls of some objects. Functions go by GCC's titles: link names, with the file in front of local ones."""

    def __init__(self, objects, indirect=()):
        self.name, self.frame, self.targets, self.known = {}, {}, {}, {}
        for file in objects:
            for line in Path(file).with_suffix(".ci").read_text(encoding="utf-8").splitlines():
                self._read(line)
        self.indirect = indirect

    def _read(self, line):
        if node := NODE.match(line):
            title, label = node.groups()
            self.name.setdefault(title, label.split("\\n")[0])
            if usage := USAGE.search(label):
                self.frame[title] = (int(usage[1]), usage[2])
        elif edge := EDGE.match(line):
            self.targets.setdefault(edge[1], set()).add((edge[2], edge[3] or ""))

    def roots(self, pattern):
        found = [t for t in self.frame if re.search(pattern, self.name[t])]
        if not found:
            raise Unbounded(f"no function is called like '{pattern}'")
        return found

    def bound(self, title, path=()):
        """(bytes, titles of the deepest path) from the function's own frame down."""
        if title in path:
            around = path[path.index(title):] + (title,)
            raise Unbounded("recursion: " + " -> ".join(self.name[t] for t in around))
        if title not in self.known:
            below = [self.bound(t, path + (title,)) for t in self._called(title)]
            depth, deepest = max(below, default=(0, ()))
            self.known[title] = (self._own(title) + depth, (title,) + deepest)
        return self.known[title]

    def _own(self, title):
        if title in LIBRARY:
            return LIBRARY[title]
        if title not in self.frame:
            raise Unbounded(f"unknown stack: {self.name[title]}")
        size, kind = self.frame[title]
        if kind != "static":
            raise Unbounded(f"{kind} frame: {self.name[title]}")
        return size

    def _called(self, title):
        for target, place in sorted(self.targets.get(title, ())):
            if target != "__indirect_call":
                yield target
                continue
            listed = [pattern for file, pattern in self.indirect if file in place]
            if not listed:
                raise Unbounded(f"call through a pointer: {self.name[title]}, {place}")
            for pattern in listed:
                if pattern != "none":
                    yield from self.roots(pattern)


def deepest(calls, patterns):
    """The deepest of all functions that the patterns find."""
    return max(calls.bound(title) for pattern in patterns for title in calls.roots(pattern))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--root", action="append", required=True)
    parser.add_argument("--limit", type=int, required=True)
    parser.add_argument("--indirect")
    parser.add_argument("objects", nargs="+")
    options = parser.parse_args()
    indirect = []
    if options.indirect:
        lines = [line.split("#")[0].strip() for line in Path(options.indirect).read_text(encoding="utf-8").splitlines()]
        indirect = [tuple(part.strip() for part in line.split("->")) for line in lines if line]
    failed = False
    calls = Calls(options.objects, indirect)
    for root in options.root:
        try:
            size, path = deepest(calls, [root])
        except Unbounded as why:
            print(f"{root}: {why}")
            failed = True
            continue
        over = size > options.limit
        failed |= over
        print(f"{root}: {size} bytes" + (f", more than {options.limit}" if over else ""))
        for title in path:
            print(f"  {calls.frame.get(title, (LIBRARY.get(title), ''))[0]:5} {calls.name[title][:150]}")
    return int(failed)


if __name__ == "__main__":
    sys.exit(main())
