#!/usr/bin/env python3
"""toolchains - how many cycles a Cortex-M4F or M7 needs: a model of the core that reads machine code. Nothing here is measured.

  cycles.py --core NAME --image ELF --trace TEXT --names TEXT [--objdump PROGRAM]

IMAGE ran on the emulated board with one instruction a translation block; TRACE is QEMU's log of them (-d exec,nochain). The
stretches between the functions Begin and End of the image are modelled one by one; each line of NAMES names one, in order.
Prints the cycles of each stretch, and of each of its hot loops: innermost loops without a call that take at least 5 % of the
stretch's instructions. A loop's figures are those of one turn among many equal ones.

The model issues instructions in order. It assumes that
- no instruction and no number waits for memory: zero wait states, no miss of a cache, no other bus master;
- no interrupt comes.

cortex-m7: where the pipeline descriptions of GCC (cortex-m7.md) and LLVM (ARMScheduleM7.td) differ, the slower figure.
- Two instructions issue in one cycle if the second needs nothing of the first, and if they need different units. Units: one
  FPU, one for loads and stores, one multiplier, one for branches, one shifter, two for all other integer instructions.
- These issue alone: loads and stores of several registers or of 64 bits, divisions of integers, VMRS, IT.
- A result can be used so many cycles after its instruction: integer 1, as an address 2; multiplication 2; load 2; VADD, VSUB,
  VMUL and other FPU instructions 3; VMLA and VFMA 6; VDIV and VSQRT 16, and the FPU takes nothing else meanwhile.
- A load waits until 3 cycles after a store to the same base register and offset. Other loads do not wait for stores.
- A branch ends a cycle when it is taken. It costs 6 more if it goes another way than at its last turn, and if its target
  comes from a register.

cortex-m4f: Arm's Technical Reference Manual, tables of the core and of the FPU.
- One instruction a cycle. A load or store takes 2, and 1 if the instruction before it was one, too. Of several registers: one
  cycle more than registers. A branch that is taken takes 3 (1 + P with P = 2).
- VFMA and VMLA take 3, VDIV and VSQRT 14. An FPU result that the next instruction uses costs one cycle more.
- Multiplications of integers take 1, with an addition and with a 64-bit result, too. Integer divisions take 12.
"""
import argparse
import re
import subprocess
import sys
from collections import Counter
from pathlib import Path

HOT = 0.05
LINE = re.compile(r"^\s*([0-9a-f]+):\t(\S+)\t?([^;@]*)")
SYMBOL = re.compile(r"^([0-9a-f]+) <(.*)>:$")
CONDITION = "eq|ne|cs|cc|mi|pl|vs|vc|hi|ls|ge|lt|gt|le|hs|lo"
ALIAS = {"sl": "r10", "fp": "r11", "ip": "r12", "r13": "sp", "r14": "lr", "r15": "pc"}
COMPARE = ("cmp", "cmn", "tst", "teq")
# Names that end like a condition and have none.
NOT_CONDITIONAL = ("teq", "mls", "muls", "vmls", "vnmls", "movs", "lsls", "adcs", "sbcs", "bics", "svc", "vcvt", "smlal", "umlal", "umull", "smull")
SYSTEM = ("vmsr", "nop", "dsb", "isb", "dmb", "bkpt", "cpsid", "cpsie", "mrs", "msr", "wfi", "wfe", "sev", "udf", "svc")
INTEGER = (r"(add|sub|rsb|adc|sbc|and|orr|orn|eor|bic|mov|mvn|neg|lsl|lsr|asr|ror|rrx|clz|rev|rbit|[us]xt|[us]bfx|bfi|bfc|[us]sat|adr|"
           r"cpy|qadd|qsub|sel|pkh|usad|uadd|sadd)")
ONE_OPERAND = r"(mov[sw]?$|mvn|neg|clz|rev|rbit|[us]xt[bh]$|adr)"
FLAGS = "flags"


class Unknown(Exception):
    """The model has no figure for an instruction, or the trace is not of this image; the text says why."""


def registers(text):
    """Names in an operand; a double is its two singles."""
    found = []
    for first, last in re.findall(r"\b((?:[rsd]\d+)|sl|fp|ip|sp|lr|pc)\b(?:-([rsd]\d+))?", text):
        kind, low = first[0], first[1:]
        names = [first]
        if last:
            names = [f"{kind}{k}" for k in range(int(low), int(last[1:]) + 1)]
        for name in names:
            if name[0] == "d" and name[1:].isdigit():
                found += [f"s{2 * int(name[1:])}", f"s{2 * int(name[1:]) + 1}"]
            else:
                found.append(ALIAS.get(name, name))
    return found


class Instruction:
    """What the models need to know of one line of a disassembly."""

    # kinds: alu shift mul mla div load store loads stores branch indirect call fpu fma fdiv alone
    def __init__(self, address, mnemonic, operands):
        self.address, self.text = address, f"{mnemonic} {operands}".strip()
        self.reads, self.writes, self.base, self.cell, self.target = set(), set(), set(), None, None
        self.kind, self.count, self.always = None, 1, False
        text = operands.strip()
        parts = [p.strip() for p in re.split(r",(?![^\[{]*[\]}])", text)] if text else []
        stem = self._without_condition(re.sub(r"\.[wn]$", "", mnemonic).split(".")[0])
        for reader in self._branch, self._several, self._load_or_store, self._system, self._float, self._multiply, self._integer:
            if reader(stem, text, parts):
                break
        else:
            raise Unknown(f"{self.address:x}: {self.text}")
        if "pc" in self.writes:
            self.kind = "indirect"

    def _without_condition(self, stem):
        """Of an instruction of an IT block; a branch keeps its condition."""
        found = re.fullmatch(rf"([a-z]{{2,}}?)({CONDITION})", stem)
        if not found or stem in NOT_CONDITIONAL or stem.startswith("vsel") or re.fullmatch(rf"b({CONDITION})", stem):
            return stem
        self.reads.add(FLAGS)
        return found[1]

    def _branch(self, stem, text, parts):
        if re.fullmatch(rf"b({CONDITION})?", stem) or stem in ("cbz", "cbnz"):
            self.kind = "branch"
            self.target = int(re.match(r"[0-9a-f]+", parts[-1])[0], 16)
            if stem.startswith("cb"):
                self.reads |= set(registers(parts[0]))
            elif stem != "b":
                self.reads.add(FLAGS)
            self.always = stem == "b"
        elif stem in ("bl", "blx", "bx", "tbb", "tbh"):
            self.kind = "call" if stem == "bl" else "indirect"
            self.reads |= set(registers(text)) if stem != "bl" else set()
            self.writes |= {"lr"} if stem in ("bl", "blx") else set()
        return self.kind

    def _several(self, stem, text, parts):
        """Loads and stores of a list; a list of one float is a plain one."""
        if not re.match(r"(v?push|v?pop|v?ldm|v?stm)", stem):
            return False
        listed = registers(re.search(r"{(.*)}", text)[1])
        self.count = len(listed)
        load, single = "pop" in stem or "ldm" in stem, self.count == 1 and stem.startswith("v")
        self.base = {"sp"} if text[0] == "{" else set(registers(parts[0]))
        self.kind = ("load" if load else "store") + ("" if single else "s")
        (self.writes if load else self.reads).update(listed)
        if "!" in text or text[0] == "{":
            self.writes |= self.base
        return True

    def _load_or_store(self, stem, text, parts):
        if not re.match(r"(v?ldr|v?str)", stem):
            return False
        inside = re.search(r"\[(.*?)\](!?)(.*)", text)
        load = "ld" in stem
        values = registers(text[: inside.start()]) if inside else registers(parts[0])
        self.count = len(values)
        (self.writes if load else self.reads).update(values)
        if inside:
            self.base = set(registers(inside[1] + inside[3])) - {"pc"}
            self.cell = inside[1].replace(" ", "")
            if inside[2] or inside[3]:
                self.writes |= set(registers(inside[1])[:1])
        self.kind = ("load" if load else "store") + ("s" if self.count > 1 else "")
        return True

    def _system(self, stem, text, parts):
        if stem == "vmrs":
            self.reads.add("fpscr")
            self.writes |= {FLAGS} if "APSR" in text else set(registers(parts[0]))
        elif re.fullmatch(r"it[te]{0,3}", stem):
            self.reads.add(FLAGS)
        elif stem in SYSTEM:
            self.reads |= set(registers(text))
        else:
            return False
        self.kind = "alone"
        return True

    def _float(self, stem, text, parts):
        if not stem.startswith("v"):
            return False
        fused = re.match(r"v(n?ml[as]|fn?m[as])$", stem)
        self.kind = "fdiv" if stem in ("vdiv", "vsqrt") else "fma" if fused else "fpu"
        if stem.startswith("vcmp"):
            self.reads |= set(registers(text))
            self.writes.add("fpscr")
        else:
            self.writes |= set(registers(parts[0]))
            self.reads |= set(registers(" ".join(parts[0 if fused or len(parts) == 1 else 1 :])))
        if stem.startswith("vsel"):
            self.reads.add(FLAGS)
        return True

    def _multiply(self, stem, text, parts):
        if stem in ("udiv", "sdiv"):
            self.kind = "div"
        elif re.match(r"(mla|mls|sml|uml|smmla|umaal)", stem):
            self.kind = "mla"
        elif re.match(r"(mul|smul|umul|smmul)", stem):
            self.kind = "mul"
        else:
            return False
        self._whole(parts, 2 if re.match(r"([su]mlal|[su]mull|umaal)", stem) else 1)
        if re.match(r"([su]mlal|umaal)", stem):
            self.reads |= self.writes
        return True

    def _integer(self, stem, text, parts):
        self.kind = "alu"
        if stem in COMPARE:
            self.reads |= set(registers(text))
            self.writes.add(FLAGS)
            return True
        if not re.match(INTEGER, stem):
            return False
        if re.search(r"\b(lsl|lsr|asr|ror|rrx)\b", text) or re.match(r"(lsl|lsr|asr|ror)", stem):
            self.kind = "shift"
        self._whole(parts, 1)
        if stem.endswith("s"):
            self.writes.add(FLAGS)
        if re.match(r"(adc|sbc|rrx)", stem):
            self.reads.add(FLAGS)
        if len(parts) == 2 and not re.match(ONE_OPERAND, stem) or stem in ("movt", "bfi", "bfc"):
            self.reads |= set(registers(parts[0]))
        return True

    def _whole(self, parts, results):
        self.writes |= set(registers(" ".join(parts[:results])))
        self.reads |= set(registers(" ".join(parts[results:])))

    @property
    def branches(self):
        return self.kind in ("branch", "indirect", "call")


def disassemble(listing):
    """({address: Instruction}, [(first address, name)]) of objdump's lines. Literals and padding are left out."""
    code, symbols = {}, []
    for line in listing:
        if symbol := SYMBOL.match(line):
            symbols.append((int(symbol[1], 16), symbol[2]))
        elif (found := LINE.match(line)) and not found[2].startswith("."):
            address = int(found[1], 16)
            operands = re.sub(r"\s*<.*", "", found[3]).strip()
            code[address] = (found[2], operands)
    return code, symbols


class Code(dict):
    """Instructions by address, made when first asked for."""

    def __init__(self, lines):
        super().__init__()
        self.lines = lines

    def __missing__(self, address):
        self[address] = made = Instruction(address, *self.lines[address])
        return made


class M7:
    UNIT = {"load": "lsu", "store": "lsu", "mul": "mac", "mla": "mac", "branch": "branch", "indirect": "branch", "call": "branch",
            "fpu": "fpu", "fma": "fpu", "fdiv": "fpu", "shift": "shift"}
    ALONE = ("loads", "stores", "div", "alone")
    LATENCY = {"alu": 1, "shift": 1, "mul": 2, "mla": 2, "div": 7, "load": 2, "loads": 2, "fpu": 3, "fma": 6, "fdiv": 16, "alone": 1}
    WRONG_WAY, AFTER_STORE, DIVIDING = 6, 3, 16

    def __init__(self):
        self.now, self.units, self.issued, self.closed = 0, set(), 0, False
        self.ready, self.for_address, self.last_way, self.stored = {}, {}, {}, {}
        self.fpu_free = 0

    def _next(self, cycle):
        if cycle > self.now:
            self.now, self.units, self.issued, self.closed = cycle, set(), 0, False

    def step(self, i, taken):
        at = self.now
        for register in i.reads:
            at = max(at, self.ready.get(register, 0))
        for register in i.base:
            at = max(at, self.for_address.get(register, 0))
        latency = self.LATENCY.get(i.kind, 1)
        for register in i.writes:  # no result comes before an older one of the same register
            at = max(at, self.ready.get(register, 0) - latency)
        if self.UNIT.get(i.kind) == "fpu":
            at = max(at, self.fpu_free)
        if i.kind == "load" and i.cell in self.stored:
            at = max(at, self.stored[i.cell][0] + self.AFTER_STORE)
        self._next(at)
        unit = self.UNIT.get(i.kind)
        alone = i.kind in self.ALONE or i.count > 1
        if self.issued and (alone or self.closed or self.issued == 2 or unit in self.units):
            self._next(self.now + 1)
        if unit:
            self.units.add(unit)
        self.issued += 1
        self.closed |= alone
        for register in i.writes:
            updates = register in i.base
            self.ready[register] = self.now + (1 if updates else latency)
            self.for_address[register] = self.now + (1 if updates else latency + (i.kind in ("alu", "shift", "mul", "mla")))
        if i.kind == "fdiv":
            self.fpu_free = self.now + self.DIVIDING
        if i.kind == "store" and i.cell:
            self.stored[i.cell] = (self.now, i.base)
        if self.stored:  # a store is forgotten after some cycles, and when its base register changes
            self.stored = {cell: (when, base) for cell, (when, base) in self.stored.items()
                           if when + self.AFTER_STORE > self.now and not base & i.writes}
        if i.kind in ("loads", "stores"):  # two registers a cycle
            self._next(self.now + (i.count + 1) // 2)
        if i.kind == "div":
            self._next(self.now + self.LATENCY["div"])
        if i.branches and taken:
            wrong = i.kind == "indirect"
            if i.kind == "branch" and not i.always:
                wrong = self.last_way.get(i.address, True) is not True
            self._next(self.now + 1 + (self.WRONG_WAY if wrong else 0))
        elif i.branches and self.last_way.get(i.address, False):
            self._next(self.now + 1 + self.WRONG_WAY)
        if i.kind == "branch":
            self.last_way[i.address] = taken

    def cycles(self):
        return self.now + (self.issued > 0)


class M4:
    COST = {"div": 12, "fma": 3, "fdiv": 14}

    def __init__(self):
        self.spent, self.before = 0, None

    def step(self, i, taken):
        before = self.before
        cost = self.COST.get(i.kind, 1)
        if i.kind in ("load", "store"):
            cost = 1 if before is not None and before.kind in ("load", "store") and not i.base & before.writes - before.base else 2
        elif i.kind in ("loads", "stores"):
            cost = 1 + i.count
        elif i.kind == "indirect":
            cost = (1 + i.count if i.count > 1 else 1) + 2
        elif i.branches and taken:
            cost = 3
        if before is not None and before.kind in ("fpu", "fma", "fdiv") and before.writes & i.reads:
            cost += 1
        self.spent += cost
        self.before = i

    def cycles(self):
        return self.spent


CORES = {"cortex-m4f": M4, "cortex-m7": M7}


def model(core, stream):
    """Cycles of instructions that are executed one after the other."""
    machine = CORES[core]()
    for k, i in enumerate(stream):
        after = stream[k + 1].address if k + 1 < len(stream) else None
        machine.step(i, after is not None and i.branches and after not in (i.address + 2, i.address + 4))
    return machine.cycles()


def turn(core, body):
    """Cycles of one turn of a loop, among many."""
    machine = CORES[core]()
    marks = []
    for _ in range(24):
        for i in body:
            machine.step(i, i is body[-1])
        marks.append(machine.cycles())
    return (marks[-1] - marks[7]) / (len(marks) - 8)


def hot_loops(stream):
    """(share of the stream's instructions, body) of its innermost loops."""
    times = Counter(i.address for i in stream)
    code = {i.address: i for i in stream}
    ends = [(i.target, i.address) for i in code.values() if i.kind == "branch" and i.target is not None and i.target <= i.address]
    found = []
    for first, last in sorted(set(ends)):
        if any(first <= f and l <= last and (f, l) != (first, last) for f, l in ends):
            continue
        body = [code[a] for a in sorted(code) if first <= a <= last]
        turns = min(times[i.address] for i in body)
        if any(i.kind in ("call", "indirect") for i in body):
            continue
        share = turns * len(body) / len(stream)
        if share >= HOT:
            found.append((share, body))
    return found


def stretches(trace, begin, end):
    """The addresses between a call of `begin` and one of `end`, in lists."""
    running = None
    for line in trace:
        if not line.startswith("Trace"):
            continue
        at = int(line.split("/")[1], 16)
        if at == begin:
            running = []
        elif at == end and running is not None:
            yield running
            running = None
        elif running is not None:
            running.append(at)


def measure(core, image, trace, names, objdump):
    """(stretches, loops): rows of figures."""
    listing = subprocess.run([objdump, "-d", "-C", "--no-show-raw-insn", image], check=True, capture_output=True, text=True).stdout
    lines, symbols = disassemble(listing.splitlines())
    code = Code(lines)
    at = {name.split("(")[0]: address for address, name in symbols}
    rows, loops, names_of = [], {}, {}
    with open(trace, encoding="utf-8") as log:
        found = list(stretches(log, at["Begin"], at["End"]))
        if len(found) != len(names):
            raise Unknown(f"{len(found)} stretches in the trace, {len(names)} names")
        for name, addresses in zip(names, found):
            stream = [code[a] for a in addresses]
            rows.append({"modelled": name, "instructions": len(stream), "cycles": model(core, stream)})
            for share, body in hot_loops(stream):
                owner = max(s for s in symbols if s[0] <= body[0].address)
                short = re.sub(r"^.*?::(?=\w+(<[^()]*>)?\()", "", owner[1]).split("(")[0]
                place = re.sub(r"\W+", "_", short).strip("_").replace("_float", "")
                while names_of.setdefault(place, body[0].address) != body[0].address:
                    place += "_next"
                divides = any(i.kind == "fdiv" for i in body)
                loops.setdefault(place, {"loop": place, "instructions": len(body), "cycles": round(turn(core, body)),
                                         "divides": divides, "of": []})
                loops[place]["of"].append(f"{name} {share:.0%}")
    return rows, list(loops.values())


def table(core, rows, loops):
    """The figures as text."""
    lines = [f"{core}: MODELLED cycles of one sample or call, and of a turn of each loop that takes 5 % of one (toolchains/cycles.py)"]
    for kind, figures in ("modelled", rows), ("loop", loops):
        lines.append(f"{kind:28}{'instr.':>8}{'cycles':>8}{'ratio':>7}")
        for row in figures:
            lines.append(f"{row[kind]:28}{row['instructions']:8}{row['cycles']:8}{row['cycles'] / row['instructions']:7.2f}"
                         + (f"  {', '.join(row['of'])}" if "of" in row else ""))
    return "\n".join(lines) + "\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name in ["core", "image", "trace", "names"]:
        parser.add_argument("--" + name, required=True)
    parser.add_argument("--objdump", default="arm-none-eabi-objdump")
    options = parser.parse_args()
    names = Path(options.names).read_text(encoding="utf-8").split()
    rows, loops = measure(options.core, options.image, options.trace, names, options.objdump)
    print(table(options.core, rows, loops))
    return 0


if __name__ == "__main__":
    sys.exit(main())
