# leaderboard - runs each rival on each case, scores the verdicts, writes the table.
#
#   leaderboard.py OUT_DIR JUDGED_SCORE SEED RIVAL...
# A rival is a program RIVAL CASE_DIR VERDICT.json, with a line "# row: NAME | what it is given". It is stopped after LIMIT_S.
import json
import os
import pathlib
import re
import resource
import subprocess
import sys

LIMIT_S = 600
HERE = pathlib.Path(__file__).parent
SHARES = {
    "logs read": "II logs that are read",
    "controls: silent": "II controls: silent",
    "single: joint": "II single: joint",
    "single: kind, joint": "II single: kind or class, and joint",
    "unrecorded: joint, signal": "II unrecorded: joint and signal",
    "several: named": "II several: effect named",
}


def cpu_s():
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def run(rival, case, verdict):
    """CPU seconds; what went wrong goes beside the verdict."""
    command = {".py": [sys.executable, "-W", "ignore"], ".sh": ["bash"]}.get(rival.suffix, []) + [str(rival)]
    start = cpu_s()
    with open(verdict.with_suffix(".txt"), "w") as said:
        try:
            subprocess.run(command + [str(case), str(verdict)], stdout=said, stderr=said, timeout=LIMIT_S, check=False,
                           env=os.environ | {"PYTHONPATH": str(HERE)})
        except subprocess.TimeoutExpired:
            said.write(f"stopped after {LIMIT_S} s\n")
    used = cpu_s() - start
    if verdict.exists():
        content = json.loads(verdict.read_text())
        verdict.write_text(json.dumps(content | {"seconds": used}))
    return used


def median(values):
    values = sorted(values)
    return values[len(values) // 2] if values else None


def over_floor_of_controls(truths, verdicts):
    """Where nothing is missing: how well a rival fits the declared model."""
    over = []
    for path in truths:
        truth, verdict = json.loads((path / "truth.json").read_text()), verdicts / f"{path.name}.json"
        if truth["effects"] or truth["channel"] == "jittered samples" or not verdict.exists():
            continue
        over += [a / f for a, f in zip(json.loads(verdict.read_text())["after"], truth["test_floor_derived"])]
    return median(over)


def row(out, score_program, rival):
    name, given = re.search(r"^# row: (.*?) \| (.*)$", rival.read_text(), re.MULTILINE).groups()
    verdicts = out / "verdicts" / rival.stem
    verdicts.mkdir(parents=True)
    cases = sorted((out / "cases").iterdir())
    seconds = [run(rival, case, verdicts / f"{case.name}.json") for case in cases]
    result = {"name": name, "given": given, "cases": len(cases), "seconds": median(seconds)}
    if not any(verdicts.glob("*.json")):
        lines = (verdicts / f"{cases[0].name}.txt").read_text().strip().splitlines()
        return result | {"cannot_run": lines[-1] if lines else "no verdict, no message"}
    scored = out / "scores" / rival.stem / "score.json"
    scored.parent.mkdir(parents=True)
    subprocess.run([score_program, out / "truth", verdicts, scored], stdout=subprocess.DEVNULL, check=True)
    score = json.loads(scored.read_text())
    return result | {
        "shares": {title: score["shares"].get(key) for title, key in SHARES.items()},
        "over_floor_controls": over_floor_of_controls(sorted((out / "truth").iterdir()), verdicts),
        "over_floor": score["after_over_floor"],
        "spurious_a_case": score.get("spurious_a_case"),
    }


def text(one, key):
    if key in SHARES:
        share = one["shares"][key]
        return f"{share['good']} of {share['all']}" if share else "-"
    return "-" if one[key] is None else f"{one[key]:.3f}"


def table(rows, seed):
    titles = ["", *SHARES, "spurious a case", "error / floor, controls", "with effects, median", "90 % of joints below", "CPU s a case"]
    lines = [f"Seed {seed}, {rows[0]['cases']} cases, one core each.", "", "| " + " | ".join(titles) + " |", "| --- " * len(titles) + "|"]
    for one in rows:
        if "cannot_run" in one:
            lines.append(f"| {one['name']} | cannot run: {one['cannot_run']} " + "| " * (len(titles) - 2) + "|")
            continue
        figures = [text(one, "spurious_a_case"), text(one, "over_floor_controls"), *(text(one["over_floor"], q) for q in ("median", "p90"))]
        cells = [one["name"], *(text(one, key) for key in SHARES), *figures, f"{one['seconds']:.1f}"]
        lines.append("| " + " | ".join(cells) + " |")
    lines += ["", "| | what it is given |", "| --- | --- |", *(f"| {one['name']} | {one['given']} |" for one in rows)]
    return "\n".join(lines) + "\n"


def main():
    out, score_program, seed = pathlib.Path(sys.argv[1]), sys.argv[2], sys.argv[3]
    rows = []
    for rival in sys.argv[4:]:
        rows.append(row(out, score_program, pathlib.Path(rival).resolve()))
        (out / "leaderboard.json").write_text(json.dumps({"seed": int(seed), "rows": rows}, indent=1))
        (out / "leaderboard.md").write_text(table(rows, seed))
    print(table(rows, seed))


main()
