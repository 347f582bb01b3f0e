# row: Oracle | reads the truth
import json
import pathlib
import sys

case, out = map(pathlib.Path, sys.argv[1:])
truth = json.loads((case.parents[1] / "truth" / case.name / "truth.json").read_text())
terms = [
    {
        "kind": (effect["accept_kinds"] or [effect["kind"]])[0],
        "also_fits": [],
        "joint": effect["joint"],
        "signals": effect["depends_on"],
        "confirmed": True,
        "score": effect["score"],
        "parameters": {},
        "parameter_sd": {},
    }
    for effect in truth["effects"]
    if effect["detectable"]
]
out.write_text(json.dumps({"after": truth["test_floor_derived"], "terms": terms, "payload": None}))
