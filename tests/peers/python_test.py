# peers - the Python package: its regressor against Pinocchio, its results against the program's, its refusals, and that
# other threads run meanwhile.
#
#   python_test.py ARMCAL FOLDER
# The rigid columns are base parameters, so no single column has a counterpart elsewhere. But the torque that Pinocchio
# computes for bodies of any mass must lie in the span of the columns, and so must not the torque of another arm.
import ast
import importlib.metadata
import json
import pathlib
import subprocess
import sys
import threading
import time
import warnings

import numpy as np
import pinocchio

import armcal

LINK = ('<link name="{0}"><inertial><origin xyz="{2}" rpy="0.3 -0.2 0.5"/><mass value="{1}"/>'
        '<inertia ixx="0.02" ixy="0.001" ixz="-0.002" iyy="0.03" iyz="0.0015" izz="0.025"/></inertial></link>\n')
JOINT = ('<joint name="{0}" type="revolute"><parent link="{1}"/><child link="{2}"/><origin xyz="{3}" rpy="{4}"/>'
         '<axis xyz="{5}"/><limit lower="-1.5" upper="1.5" effort="80" velocity="3"/></joint>\n')
TOLERANCE = 1e-9  # of the largest torque: base parameters are printed with 14 digits


def urdf(second_axis):
    text = '<robot name="r">\n<link name="base"/>\n'
    for k, (centre, place, turn, axis) in enumerate((("0.05 0.02 0.1", "0 0 0.3", "0.4 0 0.1", "0 0.6 0.8"),
                                                     ("0.1 0 -0.05", "0.2 0 0.1", "0 0.7 0", second_axis),
                                                     ("0 0.08 0.02", "0 0.1 0.3", "0.2 0.3 -1", "0 0 -1"))):
        text += LINK.format(f"l{k + 1}", 5 - k, centre)
        text += JOINT.format(f"j{k + 1}", "base" if k == 0 else f"l{k}", f"l{k + 1}", place, turn, axis)
    return text + "</robot>\n"


def unexplained(Y, torque):
    """Largest share of the torque that no parameters give."""
    A = Y.reshape(-1, Y.shape[2])
    A = A / np.maximum(np.linalg.norm(A, axis=0), 1e-300)
    x = np.linalg.lstsq(A, torque.reshape(-1), rcond=None)[0]
    return np.max(np.abs(A @ x - torque.reshape(-1))) / np.max(np.abs(torque))


def check_regressor(robot, random):
    q, v, a = (random.uniform(-1.4, 1.4, (300, 3)) for _ in range(3))
    Y = armcal.regressor(robot, q, v, a)
    assert Y.shape == (300, 3, len(robot.columns)) and Y.dtype == np.float64 and Y.flags.c_contiguous
    assert len(robot.units) == len(robot.columns) and robot.joints == 3
    for axis, same in (("1 1 0", True), ("1 0.9 0", False)):
        model = pinocchio.buildModelFromXML(urdf(axis))
        data = model.createData()
        for body in model.inertias.tolist()[1:]:
            body.mass *= random.uniform(0.5, 2)
        left = unexplained(Y, np.array([pinocchio.rnea(model, data, *state) for state in zip(q, v, a)]))
        print(f"axis {axis}: largest torque that the columns do not explain {left:.2g} of the largest torque")
        assert (left < TOLERANCE) == same, left
    # The same numbers in another memory order, and of a view with gaps.
    wide = np.zeros((600, 6))
    wide[::2, ::2] = q
    assert np.array_equal(armcal.regressor(robot, wide[::2, ::2], np.asfortranarray(v), a), Y)


def refused(error, begin, call):
    try:
        call()
    except error as caught:
        assert str(caught).startswith(begin) and "\n" not in str(caught), str(caught)
        return
    raise AssertionError(f"accepted, expected: {begin}")


def check_refusals(robot):
    good = np.zeros((10, 3))
    for name in ("q", "qd", "qdd", "temp"):
        def call(bad):
            given = {"q": good, "qd": good, "qdd": good, "temp": good} | {name: bad}
            return armcal.regressor(robot, **given)
        for value in (np.nan, np.inf):
            bad = good.copy()
            bad[7, 1] = value
            refused(ValueError, f"{name}: not a finite number at [7, 1]", lambda: call(bad))
        refused(ValueError, f"{name}: shape (10, 2), expected (", lambda: call(np.zeros((10, 2))))
        refused(ValueError, f"{name}: shape (10,), expected (", lambda: call(np.zeros(10)))
        for dtype in (np.float32, np.int64, np.complex128, object):
            refused(ValueError, f"{name}: expected ", lambda: call(good.astype(dtype)))
        refused(ValueError, f"{name}: expected a numpy array", lambda: call([[0.0] * 3] * 10))
    refused(ValueError, "qd: shape (9, 3), expected (10, 3)", lambda: armcal.regressor(robot, good, good[1:], good))
    for step in (0.0, -1.0, np.nan, np.inf):
        refused(ValueError, "step_s: ", lambda: armcal.regressor(robot, good, good, good, step_s=step))
    assert armcal.regressor(robot, good[:0], good[:0], good[:0]).shape[0] == 0


def check_input_error(program, folder):
    """The one line of the program, without its name."""
    bad = folder / "bad.toml"
    bad.write_text("name = 3\n")
    for path in (str(bad), "no_such_robot"):
        said = subprocess.run([program, "evaluate", "--robot", path, "no.csv"], capture_output=True, text=True).stderr
        assert said.startswith("armcal: "), said
        try:
            armcal.Robot(path)
        except armcal.InputError as error:
            assert f"armcal: {error}" == said.rstrip("\n"), (str(error), said)
        else:
            raise AssertionError(path)


def check_threads(robot):
    """Another thread counts while a regressor is computed; it could not if the call held the interpreter's lock."""
    states = np.random.default_rng(1).uniform(-1, 1, (100000, 3))
    done, counted = threading.Event(), [0]

    def count():
        while not done.is_set():
            counted[0] += 1
            time.sleep(0)

    other = threading.Thread(target=count)
    sys.setswitchinterval(100)  # nobody is made to yield: the count rises only where the lock is given up
    try:
        other.start()
        while counted[0] == 0:
            time.sleep(0)
        before = counted[0]
        armcal.regressor(robot, states, states, states)
        after = counted[0]
    finally:
        done.set()
        sys.setswitchinterval(0.005)
        other.join()
    assert after > before


def check_stub():
    """The stub is installed, and it declares every public name and nothing else."""
    installed = pathlib.Path(armcal.__file__).parent
    assert (installed / "py.typed").exists()
    tree = ast.parse((installed / "__init__.pyi").read_text())
    declared = {node.name: node for node in tree.body if isinstance(node, (ast.ClassDef, ast.FunctionDef))}
    assert sorted(declared) == sorted(armcal.__all__), declared
    for kind in (armcal.Robot, armcal.Log):
        members = {node.name for node in declared[kind.__name__].body if isinstance(node, ast.FunctionDef)}
        assert members - {"__init__"} == {name for name in dir(kind) if not name.startswith("_")}, members
    assert issubclass(armcal.InputError, ValueError) and "float64" in armcal.regressor.__doc__


NOISE = np.array([0.05, 0.05, 0.02])  # N m
COULOMB, VISCOUS, RIPPLE, PER_RAD = 0.6, 0.4, 0.3, 37.0


def run_of_arm(seed):
    """A run of the arm by Pinocchio: friction, noise, and a ripple on joint 2 that no robot file declares."""
    random = np.random.default_rng(seed)
    model = pinocchio.buildModelFromXML(urdf("1 1 0"))
    data = model.createData()
    t = np.arange(15000) * 0.004
    w = 2 * np.pi * np.arange(1, 6)[:, None] * 0.05
    a, b = random.uniform(-0.22, 0.22, (2, 5, 3))
    q = np.sin(w * t).T @ a + np.cos(w * t).T @ b
    v = (w * np.cos(w * t)).T @ a - (w * np.sin(w * t)).T @ b
    acc = -(w**2 * np.sin(w * t)).T @ a - (w**2 * np.cos(w * t)).T @ b
    tau = np.array([pinocchio.rnea(model, data, *state) for state in zip(q, v, acc)])
    tau += COULOMB * np.tanh(v / 0.001) + VISCOUS * v + NOISE * random.standard_normal(q.shape)
    tau[:, 1] += RIPPLE * np.sin(PER_RAD * q[:, 1])
    return t, q, tau


def write_csv(path, t, q, tau):
    names = ["t"] + [f"{word}{j}" for word in ("q", "tau") for j in (1, 2, 3)]
    np.savetxt(path, np.column_stack([t, q, tau]), fmt="%.17g", delimiter=",", header=",".join(names), comments="")


def check_results(program, robot_file, folder):
    """Arrays, a file read here and the program on that file: the same numbers."""
    robot, runs, files, logs = armcal.Robot(str(robot_file)), [], [], []
    for seed in (11, 12):
        runs.append(run_of_arm(seed))
        files.append(str(folder / f"run{seed}.csv"))
        write_csv(files[-1], *runs[-1])
        logs.append(armcal.Log(*runs[-1], name=files[-1]))
    read = armcal.read_log(files[0])
    assert (read.samples, read.joints, read.name, read.notes) == (15000, 3, files[0], [])
    assert all(np.array_equal(a, b) for a, b in zip((read.t, read.q, read.tau), runs[0]))

    def command(verb, *words):
        out = folder / f"{verb}.json"
        subprocess.run([program, verb, *words, "--json", out], check=True, capture_output=True)
        return json.loads(out.read_text())

    def agree(verb, here, there, own=()):
        for key in ("train", "test", "seconds", "provenance", "separate"):
            here.pop(key, None), there.pop(key, None)
        for key in own:
            assert here.pop(key), key
        for term in here.get("terms", []) + there.get("terms", []):
            term.pop("separate")  # names files
        assert here == there, (verb, [key for key in there if here.get(key) != there[key]])

    given = ["--robot", str(robot_file)]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        identified = armcal.identify(robot, logs[0], test=logs[1])
        found = armcal.diagnose(robot, [read], logs[1])
        evaluated = armcal.evaluate(robot, logs, table=str(folder / "identify.json")) if command(
            "identify", *given, "--train", files[0], "--test", files[1]) else None
    # The truth first: friction, and a ripple that is named with its joint and frequency.
    value = {column["name"]: column["value"] for column in identified["columns"]}
    assert abs(value["Fc1"] - COULOMB) < 0.03 and abs(value["Fv1"] - VISCOUS) < 0.03, value
    ripple = [term for term in found["terms"] if term["kind"] == "torque_ripple" and term["confirmed"]]
    assert [term["joint"] for term in ripple] == [2] and abs(ripple[0]["eta"][0] - PER_RAD) < 0.1, found["terms"]
    assert np.all(np.array(found["after_moving"]) < 1.1 * NOISE), found["after_moving"]
    print(f"ripple on joint 2 at {ripple[0]['eta'][0]:.3f} 1/rad (true {PER_RAD}), left {found['after_moving']} N m")
    agree("identify", identified, json.loads((folder / "identify.json").read_text()))
    agree("diagnose", found, command("diagnose", *given, "--train", files[0], "--test", files[1]), ["model_file"])
    agree("evaluate", evaluated, {key: value for key, value in command(
        "evaluate", *given, "--table", str(folder / "identify.json"), *files).items() if key != "table"})

    t, q, tau = runs[0]
    refused(ValueError, "tau: shape (15000, 2), expected (15000, 3)", lambda: armcal.Log(t, q, tau[:, :2]))
    refused(ValueError, "t: not a finite number at [3]", lambda: armcal.Log(np.where(t == t[3], np.nan, t), q, tau))
    refused(armcal.InputError, "log: has 100 samples, expected at least 200", lambda: armcal.Log(t[:100], q[:100], tau[:100]))
    refused(armcal.InputError, "log:1: column 't': time goes back", lambda: armcal.Log(t[::-1].copy(), q, tau))
    refused(ValueError, "train: expected a Log, or a list", lambda: armcal.identify(robot, []))
    refused(ValueError, "train: expected a Log, or a list", lambda: armcal.identify(robot, "run.csv"))
    refused(ValueError, "test: expected a Log", lambda: armcal.diagnose(robot, logs[0], "run.csv"))
    refused(ValueError, "cutoff_Hz: ", lambda: armcal.identify(robot, logs[0], cutoff_Hz=-1.0))
    scaled = armcal.Log(t, q, 1000 * tau, name="scaled")  # mN m
    refused(armcal.InputError, "scaled: ", lambda: armcal.identify(robot, scaled))
    refused(armcal.InputError, "no_such.csv", lambda: armcal.read_log("no_such.csv"))
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        armcal.identify(robot, logs[0], test=armcal.Log(t + 100, q, tau, name="again"))
    assert any("not held out" in str(one.message) for one in said), [str(one.message) for one in said]


def check_version(program):
    said = subprocess.run([program, "--version"], capture_output=True, text=True, check=True).stdout.split()[-1]
    assert importlib.metadata.version("armcal") == said, said


def main():
    program, folder = sys.argv[1], pathlib.Path(sys.argv[2])
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "r.urdf").write_text(urdf("1 1 0"))
    subprocess.run([program, "import", folder / "r.urdf", "-o", folder / "r.toml", "--overwrite"], check=True, capture_output=True)
    robot = armcal.Robot(str(folder / "r.toml"))
    check_regressor(robot, np.random.default_rng(7))
    check_refusals(robot)
    check_input_error(program, folder)
    check_results(program, folder / "r.toml", folder)
    check_threads(robot)
    check_stub()
    check_version(program)
    print("ok")


if __name__ == "__main__":
    main()
