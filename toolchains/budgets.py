#!/usr/bin/env python3
"""toolchains - what filters and regressors cost on a core: a table, the same as JSON, and a failure when a figure has risen.

  budgets.py --core NAME --bench TEXT --budgets TOML --json OUT --size PROGRAM --objects LIST

Instructions come from the bench that ran on the emulated board, bytes of code from the objects, stack from their call graphs
(toolchains/stack.py); the bench's painted stack must not be deeper. Figures are compared with the core's accepted ones in
TOML and with its limits; a message names the figure, and for accepted ones the line to put into TOML.
"""
import argparse
import json
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import stack

FILTER_KEYS = ["instructions", "solve", "read_out", "slice_max", "slice_min", "text_bytes", "state_bytes", "stack_bytes"]
REGRESSOR_KEYS = ["instructions", "text_bytes", "stack_bytes"]
ESTIMATOR_KEYS = ["push", "push_max", "sample", "slice_max", "state_bytes"]
READ_OUT_KEYS = ["instructions", "slices", "slice_max", "hand_over", "state_bytes", "stack_bytes"]
NOT_THE_FILTERS = re.compile(r"Get_|Calls|\.rodata.*\.str")  # the bench's own part of an object


def read_bench(path):
    """Lines "kind name key value key value ..." as dictionaries."""
    rows = []
    for line in Path(path).read_text(encoding="utf-8").splitlines():
        kind, name, *pairs = line.split()
        rows.append({"kind": kind, "name": name} | {k: int(v) for k, v in zip(pairs[::2], pairs[1::2])})
    return rows


def text_bytes(size, file):
    """Code and constants of an object."""
    listing = subprocess.run([size, "-A", file], check=True, capture_output=True, text=True).stdout
    sections = re.findall(r"^(\.(?:text|rodata)\S*)\s+(\d+)", listing, re.MULTILINE)
    return sum(int(count) for name, count in sections if not NOT_THE_FILTERS.search(name))


def stack_bytes(file, root, faults):
    try:
        return stack.deepest(stack.Calls([file]), [root])[0]
    except stack.Unbounded as why:
        faults.append(f"{Path(file).stem}: {why}")
        return -1


def measure(rows, objects, size, faults):
    """The rows of the JSON file, by kind."""
    by_name = {Path(o).name.split(".")[0]: o for o in objects}
    figures = {"filters": [], "regressors": [], "estimators": [], "read_outs": []}
    for row in rows:
        if row["kind"] == "estimator":
            figures["estimators"].append({"estimator": row["name"]} | {k: row[k] for k in ESTIMATOR_KEYS})
            continue
        if row["kind"] == "read_out":
            figures["read_outs"].append({"read_out": row["name"]} | {k: row[k] for k in READ_OUT_KEYS})
            continue
        is_filter = row["kind"] == "filter"
        name = f"{row['name']}_{row['n']}" if is_filter else f"regressor_{row['name']}"
        file = by_name[name]
        for key in [k for k in row if k.endswith("_least")]:
            most = row[key.removesuffix("_least")]
            if most != row[key]:
                faults.append(f"{name}: {key.removesuffix('_least')} depend on the data: {row[key]} to {most}")
        code = {"text_bytes": text_bytes(size, file)}
        deep = stack_bytes(file, r"Instance<.*>::" if is_filter else r"::Evaluate\(", faults)
        if row["painted_bytes"] > deep >= 0:
            faults.append(f"{name}: painted stack {row['painted_bytes']} bytes, deeper than the bound {deep}")
        if is_filter:
            figures["filters"].append({
                "filter": row["name"], "n": row["n"], "n_front": row["n_front"], "instructions": row["instructions"],
                "solve": row["solve"], "read_out": row["read_out"], "slice_max": row["slice_max"], "slice_min": row["slice_min"], **code,
                "state_bytes": row["state_bytes"], "stack_bytes": deep})
        else:
            figures["regressors"].append(
                {"robot": row["name"], "instructions": row["instructions"], **code, "stack_bytes": deep})
    return figures


def label(row):
    return f"{row['filter']}_{row['n']}" if "filter" in row else row.get("robot") or row.get("estimator") or row["read_out"]


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
            if before is not None and key != "slice_min" and now > before * (1 + rise):
                faults.append(f"{name}: {key} {now}, was {before} (+{100 * (now / before - 1):.1f} %)")
            if most is not None and now > most:
                faults.append(f"{name}: {key} {now}, limit {most}")
        ratio = limits.get(name, {}).get("slice_ratio")
        if ratio is not None and row["slice_max"] > ratio * row["slice_min"]:
            faults.append(f"{name}: slices of {row['slice_min']} to {row['slice_max']}, limit 1 : {ratio}")
        if any(known.get(k) != row[k] for k in keys):
            lines.append(line)
    if lines:
        print(f"\nnot as accepted in toolchains/budgets.toml; the lines now, under [{section}]:")
        print("\n".join(lines))


def table(figures, core, budgets):
    clock, rate = budgets["clock_MHz"][core], budgets["sample_rate_Hz"]
    cpi = budgets["cycles_per_instruction"][core]

    def share(row):
        return row["instructions"] * cpi * rate / (clock * 1e6)

    lines = [f"{core}: instructions a 6-row sample; share of {clock} MHz at {rate} samples/s, ESTIMATED with {cpi} cycles an "
             "instruction; bytes", f"{'filter':14}{'n':>4}{'front':>6}{'instr.':>9}{'share':>8}{'solve':>8}{'read-out':>9}{'slice':>7}"
             f"{'least':>8}{'text':>7}{'state':>7}{'stack':>6}"]
    lines += [f"{f['filter']:14}{f['n']:4}{f['n_front']:6}{f['instructions']:9}{share(f):8.2%}{f['solve']:8}{f['read_out']:9}{f['slice_max']:7}"
              f"{f['slice_min']:8}{f['text_bytes']:7}{f['state_bytes']:7}{f['stack_bytes']:6}" for f in figures["filters"]]
    lines += [f"{'regressor':24}{'instr.':>9}{'share':>8}{'text':>24}{'stack':>13}"]
    lines += [f"{r['robot']:24}{r['instructions']:9}{share(r):8.2%}{r['text_bytes']:24}{r['stack_bytes']:13}"
              for r in figures["regressors"]]
    lines += [f"{'estimator, er20_like':24}{'tick':>8}{'longest':>9}{'sample':>9}{'slice':>8}{'state':>8}"]
    lines += [f"{e['estimator']:24}{e['push']:8}{e['push_max']:9}{e['sample']:9}{e['slice_max']:8}{e['state_bytes']:8}"
              for e in figures["estimators"]]
    if figures["read_outs"]:
        lines += [f"{'physical read-out, er20_like':28}{'instr.':>10}{'slices':>8}{'longest':>9}{'hand-over':>11}{'state':>8}{'stack':>7}"]
    lines += [f"{r['read_out']:28}{r['instructions']:10}{r['slices']:8}{r['slice_max']:9}{r['hand_over']:11}{r['state_bytes']:8}"
              f"{r['stack_bytes']:7}" for r in figures["read_outs"]]
    return "\n".join(lines) + "\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name in ["core", "bench", "budgets", "json", "size", "objects"]:
        parser.add_argument("--" + name, required=True)
    options = parser.parse_args()
    budgets = tomllib.loads(Path(options.budgets).read_text(encoding="utf-8"))
    faults = []
    objects = Path(options.objects).read_text(encoding="utf-8").split()
    figures = measure(read_bench(options.bench), objects, options.size, faults)
    Path(options.json).write_text(json.dumps({"core": options.core, **figures}, indent=1) + "\n", encoding="utf-8")
    text = table(figures, options.core, budgets)
    Path(options.json).with_suffix(".txt").write_text(text, encoding="utf-8")
    print(text)
    accepted, rise = budgets.get(options.core, {}), budgets["rise"]
    for kind, keys in ("filters", FILTER_KEYS), ("regressors", REGRESSOR_KEYS), ("estimators", ESTIMATOR_KEYS), \
            ("read_outs", READ_OUT_KEYS):
        compare(figures[kind], keys, accepted.get(kind, {}), budgets["limits"], f"{options.core}.{kind}", rise, faults)
    for fault in faults:
        print(f"over budget: {fault}", file=sys.stderr)
    return int(bool(faults))


if __name__ == "__main__":
    sys.exit(main())
