#!/usr/bin/env python3
"""tests - the model of the cores (toolchains/cycles.py) on snippets whose cycles are counted by hand."""
import sys
import unittest
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "toolchains"))
import cycles  # noqa: E402


def body(text):
    """Instructions of a snippet, a line each; every one takes four bytes."""
    lines = [line.split(None, 1) for line in text.strip().splitlines()]
    return [cycles.Instruction(4 * k, words[0], words[1] if len(words) > 1 else "") for k, words in enumerate(lines)]


def turn(core, text):
    return cycles.turn(core, body(text))


def once(core, text):
    return cycles.model(core, body(text))


class M7(unittest.TestCase):
    def test_pairs_issue_together_if_their_units_differ(self):
        self.assertEqual(once("cortex-m7", "vldr s0, [r0]\nvmul.f32 s1, s2, s3"), 1)
        self.assertEqual(once("cortex-m7", "vldr s0, [r0]\nvldr s1, [r0, #4]"), 2)
        self.assertEqual(once("cortex-m7", "vmul.f32 s0, s2, s3\nvadd.f32 s1, s4, s5"), 2)
        self.assertEqual(once("cortex-m7", "adds r0, #1\nadds r1, #1\nadds r2, #1"), 2)

    def test_an_instruction_waits_for_its_numbers(self):
        self.assertEqual(once("cortex-m7", "vmul.f32 s0, s2, s3\nvadd.f32 s1, s0, s5"), 4)  # cycles 0 and 3
        self.assertEqual(once("cortex-m7", "vldr s0, [r0]\nvadd.f32 s1, s0, s5"), 3)
        self.assertEqual(once("cortex-m7", "vfma.f32 s0, s2, s3\nvadd.f32 s1, s0, s5"), 7)
        self.assertEqual(once("cortex-m7", "vdiv.f32 s0, s2, s3\nvadd.f32 s1, s0, s5"), 17)
        self.assertEqual(once("cortex-m7", "vdiv.f32 s0, s2, s3\nvadd.f32 s1, s4, s5"), 17)  # the FPU is busy
        self.assertEqual(once("cortex-m7", "adds r0, #4\nadds r1, r0, #1"), 2)
        self.assertEqual(once("cortex-m7", "add r0, r1, #4\nldr r2, [r0]"), 3)  # an address, one cycle more
        self.assertEqual(once("cortex-m7", "vadd.f32 s0, s1, s2\nvstr s0, [r0]"), 4)

    def test_a_load_waits_for_the_store_to_its_place(self):
        self.assertEqual(once("cortex-m7", "str r1, [sp, #4]\nldr r2, [sp, #4]"), 4)  # cycles 0 and 3
        self.assertEqual(once("cortex-m7", "str r1, [sp, #4]\nldr r2, [sp, #8]"), 2)

    def test_several_registers_issue_alone(self):
        self.assertEqual(once("cortex-m7", "push {r4, r5, r6, lr}\nadds r0, #1"), 3)  # two cycles, then the sum
        self.assertEqual(once("cortex-m7", "vldmia r0!, {s0}\nvmul.f32 s1, s2, s3"), 1)  # one register is a plain load

    def test_a_loop_of_a_chain(self):
        # 0: load; 2: product; 5: sum, with the count; 6: branch
        self.assertEqual(turn("cortex-m7", "vldr s0, [r0]\nvmul.f32 s1, s0, s4\nvadd.f32 s2, s1, s5\nsubs r1, #1\nbne.n 0"), 7)

    def test_a_loop_of_two_chains_one_in_the_other(self):
        # 0, 1: loads; 2, 3: products; 5, 6: sums, the last with the count; 7: branch
        self.assertEqual(turn("cortex-m7", "vldr s0, [r0]\nvldr s1, [r0, #4]\nvmul.f32 s2, s0, s8\nvmul.f32 s3, s1, s8\n"
                                           "vadd.f32 s4, s2, s9\nvadd.f32 s5, s3, s9\nsubs r1, #1\nbne.n 0"), 8)

    def test_an_element_after_the_other_needs_more_than_side_by_side(self):
        one = "vldr s{0}, [r0, #{1}]\nvmul.f32 s2, s{0}, s8\nvsub.f32 s{0}, s9, s2\nvmul.f32 s2, s{0}, s10\nvadd.f32 s3, s2, s11\nvstr s3, [r1, #{1}]\n"
        after = "".join(one.format(k, 4 * k) for k in (0, 1)) + "subs r2, #1\nbne.n 0"
        lines = [one.format(k, 4 * k).replace("s2", f"s{20 + k}").replace("s3", f"s{22 + k}").splitlines() for k in (0, 1)]
        beside = "\n".join(f"{a}\n{b}" for a, b in zip(*lines)) + "\nsubs r2, #1\nbne.n 0"
        count = len(body(after))
        self.assertEqual(count, len(body(beside)))
        # One chain: load 0, product 2, difference 5, product 8, sum 11, store 14. The second begins with the store, at 15.
        self.assertEqual(turn("cortex-m7", after), 31)
        self.assertGreater(turn("cortex-m7", after) / count, 1.1)
        # Side by side the second is one cycle behind: store 15, with the count; branch 16.
        self.assertEqual(turn("cortex-m7", beside), 17)

    def test_a_branch_that_goes_another_way_costs_more(self):
        loop = body("subs r1, #1\nbne.n 0") * 3
        end = cycles.Instruction(8, "nop", "")
        self.assertEqual(cycles.model("cortex-m7", loop + [end]), 3 * 2 + 6 + 1)


class M4F(unittest.TestCase):
    def test_neighbouring_loads_and_stores_take_one_cycle_more_together(self):
        self.assertEqual(once("cortex-m4f", "vldr s0, [r0]\nvldr s1, [r0, #4]\nvldr s2, [r0, #8]"), 4)
        self.assertEqual(once("cortex-m4f", "vldr s0, [r0]\nadds r1, #1\nvldr s2, [r0, #8]"), 5)
        self.assertEqual(once("cortex-m4f", "ldr r0, [r1]\nldr r2, [r0]"), 4)  # the second needs the first

    def test_arithmetic(self):
        self.assertEqual(once("cortex-m4f", "vmul.f32 s0, s2, s3\nvadd.f32 s1, s4, s5"), 2)
        self.assertEqual(once("cortex-m4f", "vmul.f32 s0, s2, s3\nvadd.f32 s1, s0, s5"), 3)
        self.assertEqual(once("cortex-m4f", "vfma.f32 s0, s2, s3\nadds r0, #1"), 4)
        self.assertEqual(once("cortex-m4f", "vdiv.f32 s0, s2, s3\nadds r0, #1"), 15)
        self.assertEqual(once("cortex-m4f", "smlal r0, r1, r2, r3\nmla r4, r5, r6, r7"), 2)
        self.assertEqual(once("cortex-m4f", "vpush {d8-d15}"), 17)

    def test_a_loop(self):
        # 2 + 1 + (1 + 1) + 1 + 3
        self.assertEqual(turn("cortex-m4f", "vldr s0, [r0]\nvmul.f32 s1, s0, s4\nvadd.f32 s2, s1, s5\nsubs r1, #1\nbne.n 0"), 9)


class Reading(unittest.TestCase):
    def test_a_disassembly_and_a_trace_give_the_loop_and_its_share(self):
        listing = ["00000010 <Begin>:", "  10:\tbx\tlr", "00000020 <armcal::math::Sum<2, float>(float*)>:",
                   "  20:\tmovs\tr1, #3", "  22:\tsubs\tr1, #1", "  24:\tbne.n\t22 <armcal::math::Sum<2, float>(float*)+0x2>",
                   "  26:\tbx\tlr", "  28:\t.word\t0x00000004"]
        lines, symbols = cycles.disassemble(listing)
        self.assertEqual(symbols[1], (0x20, "armcal::math::Sum<2, float>(float*)"))
        self.assertNotIn(0x28, lines)
        code = cycles.Code(lines)
        log = [f"Trace 0: 0x7f [00000000/{a:08x}/00000000/ff] x" for a in [0, 0x10, 0x20, 0x22, 0x24, 0x22, 0x24, 0x22, 0x24, 0x26, 0x30, 0x22]]
        (addresses,) = cycles.stretches(log, 0x10, 0x30)
        self.assertEqual(addresses, [0x20] + [0x22, 0x24] * 3 + [0x26])
        ((share, loop),) = cycles.hot_loops([code[a] for a in addresses])
        self.assertEqual(share, 6 / 8)
        self.assertEqual([i.address for i in loop], [0x22, 0x24])

    def test_an_instruction_without_a_figure_is_named(self):
        with self.assertRaisesRegex(cycles.Unknown, "frobnicate"):
            cycles.Instruction(0, "frobnicate", "r0, r1")


if __name__ == "__main__":
    unittest.main()
