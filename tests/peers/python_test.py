# peers - the Python package: its regressor against Pinocchio, its refusals, and that other threads run meanwhile.
#
#   python_test.py ARMCAL FOLDER
# The rigid columns are base parameters, so no single column has a counterpart elsewhere. But the torque that Pinocchio
# computes for bodies of any mass must lie in the span of the columns, and so must not the torque of another arm.
import ast
import importlib.metadata
import pathlib
import subprocess
import sys
import threading
import time

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
    members = {node.name for node in declared["Robot"].body if isinstance(node, ast.FunctionDef)}
    assert members - {"__init__"} == {name for name in dir(armcal.Robot) if not name.startswith("_")}, members
    assert issubclass(armcal.InputError, ValueError) and "float64" in armcal.regressor.__doc__


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
    check_threads(robot)
    check_stub()
    check_version(program)
    print("ok")


main()
