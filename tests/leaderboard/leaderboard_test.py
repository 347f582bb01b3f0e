# leaderboard - whether the scores mean what the table says, and whether each rival can fit the model that is given.
#
#   leaderboard_test.py FOLDER
# A program that reads the truth must get every share in full, and the noise floor as its error. A program that names nothing must be
# silent everywhere and name no effect. A program that fails must stand in the table with its own words. On a log that lacks nothing, the
# error of each rival must lie near the floor, which the truth states and no rival knows.
import json
import os
import pathlib
import subprocess
import sys

HERE = pathlib.Path(__file__).parent
VENV = HERE.parents[1] / "build" / "peers" / "leaderboard"
NEAR_FLOOR = 1.1
failures = []


def check(ok, what):
    print(("ok: " if ok else "FAILED: ") + what)
    if not ok:
        failures.append(what)


def main():
    folder = pathlib.Path(sys.argv[1]).resolve()
    folder.mkdir(parents=True, exist_ok=True)
    failing = folder / "failing.sh"
    failing.write_text("# row: Failing | nothing\necho 'no such library' >&2\nexit 1\n")
    rivals = [HERE / "check" / "oracle.py", HERE / "check" / "silent.py", failing]
    out = folder / "board"
    subprocess.run(["bash", HERE / "leaderboard.sh", "7", out, "1", *rivals], check=True, stdout=subprocess.DEVNULL)
    oracle, silent, failed = json.loads((out / "leaderboard.json").read_text())["rows"]

    check(not list((out / "cases").rglob("truth.json")), "no case holds its truth")
    for title, share in oracle["shares"].items():
        check(share and share["good"] == share["all"] > 0, f"the oracle has all of: {title}")
    check(oracle["spurious_a_case"] == 0, "the oracle claims nothing that is not there")
    check(oracle["over_floor"]["median"] == oracle["over_floor"]["p90"] == oracle["over_floor_controls"] == 1, "its error is the floor")
    for title, share in silent["shares"].items():
        good = share["all"] if title in ("logs read", "controls: silent") else 0
        check(share["good"] == good, f"the silent one has {good} of {share['all']}: {title}")
    check(silent["over_floor"]["median"] > 2 and silent["over_floor_controls"] > 2, "its error is far above the floor")
    check(failed.get("cannot_run") == "no such library", "the failing one stands there with its reason")
    check("cannot run: no such library" in (out / "leaderboard.md").read_text(), "and so does the table")

    case, verdict = out / "cases" / "controls_plain_0000", folder / "verdict.json"
    floor = json.loads((out / "truth" / case.name / "truth.json").read_text())["test_floor_derived"]
    python = [VENV / "bin" / "python", "-W", "ignore"]
    for rival in sorted((HERE / "rivals").glob("*.py")):
        verdict.unlink(missing_ok=True)
        subprocess.run([*python, rival, case, verdict], check=True, env=os.environ | {"PYTHONPATH": str(HERE)})
        worst = max(a / f for a, f in zip(json.loads(verdict.read_text())["after"], floor))
        check(worst < NEAR_FLOOR, f"{rival.stem}: {worst:.3f} times the floor where nothing is missing")
    sys.exit(1 if failures else 0)


main()
