#!/usr/bin/env python3
"""toolchains - what filters and regressors cost on a core: a table, the same as JSON, and a failure when a figure has risen.

  budgets.py --core NAME --bench TEXT --budgets TOML --json OUT --size PROGRAM --objects LIST
             --image ELF --trace TEXT --names TEXT --objdump PROGRAM

Instructions come from the bench that ran on the emulated board, bytes of code from the objects, stack from their call graphs
(toolchains/stack.py); the bench's painted stack must not be deeper. Cycles are modelled (toolchains/cycles.py): IMAGE, TRACE
and NAMES are what that program reads. Figures are compared with the core's accepted ones in TOML and with its limits; a
message names the figure, and for accepted ones the line to put into TOML.
"""
import argparse
import json
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import cycles
import stack

FILTER_KEYS = ["instructions", "solve", "read_out", "slice_max", "slice_min", "text_bytes", "own_bytes", "state_bytes",
               "stack_bytes"]
REGRESSOR_KEYS = ["instructions", "text_bytes", "stack_bytes"]
ESTIMATOR_KEYS = ["push", "push_max", "sample", "slice_max", "slice_min", "state_bytes"]
CONTROLLER_KEYS = ["push", "feed_forward", "feed_forward_new", "step_learning", "step_resetting", "step_checking",
                   "step_saving", "request", "other", "state_bytes"]
MODELLED_KEYS = ["instructions", "cycles"]  # of a sample or call, and of a turn of a loop
READ_OUT_KEYS = ["instructions", "slices", "slice_max", "hand_over", "hand_over_max", "state_bytes", "stack_bytes"]
NOT_THE_FILTERS = re.compile(r"Get_|Calls|MakeParts|\.rodata.*\.str")  # the bench's own part of an object
# One filter's own: code that knows the layout, and the rotations that the forgetting filter alone has. One copy of the rest serves
# all filters of a form.
OWN = re.compile(r"SixJoints|4math9FoldBlock|4math12GivensCorner")


def read_bench(path):
    """Lines "kind name key value key value ..." as dictionaries."""
    rows = []
    for line in Path(path).read_text(encoding="utf-8").splitlines():
        kind, name, *pairs = line.split()
        rows.append({"kind": kind, "name": name} | {k: int(v) for k, v in zip(pairs[::2], pairs[1::2])})
    return rows


def text_bytes(size, file, of=re.compile("")):
    """Code and constants of an object, in sections whose names match."""
    listing = subprocess.run([size, "-A", file], check=True, capture_output=True, text=True).stdout
    sections = re.findall(r"^(\.(?:text|rodata)\S*)\s+(\d+)", listing, re.MULTILINE)
    return sum(int(count) for name, count in sections if of.search(name) and not NOT_THE_FILTERS.search(name))


def stack_bytes(file, root, faults):
    try:
        return stack.deepest(stack.Calls([file]), [root])[0]
    except stack.Unbounded as why:
        faults.append(f"{Path(file).stem}: {why}")
        return -1


def measure(rows, objects, size, faults):
    """The rows of the JSON file, by kind."""
    by_name = {Path(o).name.split(".")[0]: o for o in objects}
    figures = {"filters": [], "regressors": [], "estimators": [], "controllers": [], "read_outs": []}
    for row in rows:
        is_filter = row["kind"] == "filter"
        name = f"{row['name']}_{row['n']}" if is_filter else f"{row['kind']}_{row['name']}"
        for key in [k for k in row if k.endswith("_least")]:
            most = row[key.removesuffix("_least")]
            if most != row[key]:
                faults.append(f"{name}: {key.removesuffix('_least')} depend on the data: {row[key]} to {most}")
        if row["kind"] == "stamps":  # nothing but the comparison above
            continue
        if row["kind"] == "controller":
            figures["controllers"].append({"controller": row["name"]} | {k: row[k] for k in CONTROLLER_KEYS})
            continue
        if row["kind"] == "estimator":
            figures["estimators"].append({"estimator": row["name"]} | {k: row[k] for k in ESTIMATOR_KEYS})
            continue
        if row["kind"] == "read_out":
            figures["read_outs"].append({"read_out": row["name"]} | {k: row[k] for k in READ_OUT_KEYS})
            continue
        file = by_name[name]
        deep = stack_bytes(file, r"Instance<.*>::" if is_filter else r"::Evaluate\(", faults)
        if row["painted_bytes"] > deep >= 0:
            faults.append(f"{name}: painted stack {row['painted_bytes']} bytes, deeper than the bound {deep}")
        measured = {key: row[key] for key in ["n", "n_front", *FILTER_KEYS, *REGRESSOR_KEYS] if key in row}
        kind, title = ("filters", "filter") if is_filter else ("regressors", "robot")
        measured |= {"text_bytes": text_bytes(size, file), "stack_bytes": deep}
        if is_filter:
            measured["own_bytes"] = text_bytes(size, file, OWN)
        figures[kind].append({title: row["name"]} | measured)
    return figures


def label(row):
    if "filter" in row:
        return f"{row['filter']}_{row['n']}"
    return next(row[title] for title in ["robot", "estimator", "controller", "read_out", "modelled", "loop"] if title in row)


def compare(rows, keys, accepted, limits, section, rise, faults):
    """Fails on a risen figure, a figure above its limit, and one that nobody accepted."""
    lines = []
    for row in rows:
        name, known = label(row), accepted.get(label(row), {})
        line = f"{name} = {{ " + ", ".join(f"{k} = {row[k]}" for k in keys) + " }"
        if not known:
            faults.append(f"{name}: no accepted figures")
        for key in keys:
            now, before, most = row[key], known.get(key), limits.get(name, {}).get(key)
            if isinstance(most, dict):  # a limit for each core
                most = most.get(section.split(".")[0])
            if before is not None and key != "slice_min" and now > before * (1 + rise):
                faults.append(f"{name}: {key} {now}, was {before} (+{100 * (now / before - 1):.1f} %)")
            if most is not None and now > most:
                faults.append(f"{name}: {key} {now}, limit {most}")
        ratio = limits.get(name, {}).get("slice_ratio")
        if ratio is not None and "slice_max" in row and row["slice_max"] > ratio * row["slice_min"]:
            faults.append(f"{name}: slices of {row['slice_min']} to {row['slice_max']}, limit 1 : {ratio}")
        if any(known.get(k) != row[k] for k in keys):
            lines.append(line)
    if gone := sorted(set(accepted) - {label(row) for row in rows}):
        print(f"\naccepted under [{section}], but not measured: {', '.join(gone)}")
    if lines:
        print(f"\nnot as accepted in toolchains/budgets.toml; the lines now, under [{section}]:")
        print("\n".join(lines))


def compare_ratios(figures, most, faults):
    """Fails on a loop or a filter's sample that needs too many cycles for its instructions. The latency of a division bounds a
    loop that divides, whatever the order of its instructions."""
    filters = {label(row) for row in figures["filters"]}
    for row in figures["modelled"] + figures["loops"]:
        ratio = row["cycles"] / row["instructions"]
        if ratio > most and not row.get("divides") and ("loop" in row or label(row) in filters):
            faults.append(f"{label(row)}: {ratio:.2f} modelled cycles an instruction, limit {most}")


def grid(rows, columns):
    """Text of a table; columns: title, width, how to format, what to show (a key, or a function of the row)."""
    lines = ["".join(f"{title:>{width}}" if k else f"{title:{width}}" for k, (title, width, _, _) in enumerate(columns))]
    for row in rows:
        shown = [(show(row) if callable(show) else row[show], width, form) for _, width, form, show in columns]
        lines.append("".join(f"{value:{width}{form}}" for value, width, form in shown))
    return "\n".join(lines) + "\n"


def tables(figures, core, budgets):
    clock, rate = budgets["clock_MHz"][core], budgets["sample_rate_Hz"]
    modelled = {row["modelled"]: row["cycles"] / row["instructions"] for row in figures["modelled"]}

    def part(row):
        """Of the core's time. Each filter has the cycles an instruction of its 60 columns, the bank those of its block filters."""
        of = {"bank": "kalman_block"}.get(row["filter"], row["filter"]) + "_60" if "filter" in row else "er20_like"
        return row["instructions"] * modelled[of] * rate / (clock * 1e6)

    share = ("share", 8, ".2%", part)
    slices = [("slice", 8, "", "slice_max"), ("least", 8, "", "slice_min")]
    text, state, stack_ = ("text", 7, "", "text_bytes"), ("state", 7, "", "state_bytes"), ("stack", 7, "", "stack_bytes")
    whole = (f"{core}: instructions of a sample (six rows) or a call, bytes; share of {clock} MHz at {rate} samples/s, "
             "from MODELLED cycles\n"
             "text: code and constants of a filter that is alone in an image; own: what it adds beside others of its form\n")
    whole += grid(figures["filters"], [
        ("filter", 14, "", "filter"), ("n", 4, "", "n"), ("front", 6, "", "n_front"), ("instr.", 9, "", "instructions"),
        share, ("solve", 8, "", "solve"), ("read-out", 9, "", "read_out"), *slices, text, ("own", 6, "", "own_bytes"),
        state, stack_])
    whole += grid(figures["regressors"], [
        ("regressor", 24, "", "robot"), ("instr.", 9, "", "instructions"), share, text, stack_])
    whole += grid(figures["estimators"], [
        ("estimator, er20_like", 24, "", "estimator"), ("tick", 8, "", "push"), ("longest", 9, "", "push_max"),
        ("sample", 9, "", "sample"), *slices, state])
    whole += grid(figures["controllers"], [
        ("longest call, two filters", 26, "", "controller"), ("push", 8, "", "push"), ("torque", 8, "", "feed_forward"),
        ("of a new table", 16, "", "feed_forward_new"), ("learning", 10, "", "step_learning"),
        ("resetting", 11, "", "step_resetting"), ("checking", 10, "", "step_checking"), ("saving", 8, "", "step_saving"), ("request", 9, "", "request"), ("other", 7, "", "other"), state])
    if figures["read_outs"]:
        whole += grid(figures["read_outs"], [
            ("physical read-out", 24, "", "read_out"), ("instr.", 10, "", "instructions"), ("slices", 8, "", "slices"),
            slices[0], ("hand-over", 11, "", "hand_over"), ("a call", 8, "", "hand_over_max"), state, stack_])
    return whole + cycles.table(core, figures["modelled"], figures["loops"])


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name in ["core", "bench", "budgets", "json", "size", "objects", "image", "trace", "names", "objdump"]:
        parser.add_argument("--" + name, required=True)
    options = parser.parse_args()
    budgets = tomllib.loads(Path(options.budgets).read_text(encoding="utf-8"))
    faults = []
    objects = Path(options.objects).read_text(encoding="utf-8").split()
    figures = measure(read_bench(options.bench), objects, options.size, faults)
    names = Path(options.names).read_text(encoding="utf-8").split()
    figures["modelled"], figures["loops"] = cycles.measure(options.core, options.image, options.trace, names, options.objdump)
    Path(options.json).write_text(json.dumps({"core": options.core, **figures}, indent=1) + "\n", encoding="utf-8")
    text = tables(figures, options.core, budgets)
    Path(options.json).with_suffix(".txt").write_text(text, encoding="utf-8")
    print(text)
    accepted, rise = budgets.get(options.core, {}), budgets["rise"]
    for kind, keys in ("filters", FILTER_KEYS), ("regressors", REGRESSOR_KEYS), ("estimators", ESTIMATOR_KEYS), \
            ("controllers", CONTROLLER_KEYS), ("read_outs", READ_OUT_KEYS), ("modelled", MODELLED_KEYS), \
            ("loops", MODELLED_KEYS):
        compare(figures[kind], keys, accepted.get(kind, {}), budgets["limits"], f"{options.core}.{kind}", rise, faults)
    if (most := budgets["limits"]["cycles_per_instruction"].get(options.core)) is not None:
        compare_ratios(figures, most, faults)
    for fault in faults:
        print(f"over budget: {fault}", file=sys.stderr)
    return int(bool(faults))


if __name__ == "__main__":
    sys.exit(main())
