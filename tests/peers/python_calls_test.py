# peers - the long calls of the Python package: excite against the program, what progress is told, how calls end; paths; the
# example.
#
#   python_calls_test.py ARMCAL FOLDER
import json
import pathlib
import signal
import subprocess
import sys
import threading
import warnings

import numpy as np

import armcal
from python_test import refused, run_of_arm, urdf, write_csv

CHECKOUT = pathlib.Path(__file__).resolve().parent.parent.parent


def check_excite(program, folder):
    """The program's numbers, bit for bit: in its JSON, and in its file."""
    cell = folder / "cell.toml"
    cell.write_text('[[plane]]\nname = "floor"\npoint_m = [0.0, 0.0, -0.5]\nnormal = [0.0, 0.0, 1.0]\n')
    for number, (robot, words, options) in enumerate((
            ("two_link", "--purpose test --starts 3 --seed 7 --step 0.002", dict(purpose="test", starts=3, seed=7, step=0.002)),
            ("er20_like", "--starts 2 --no-slow --margin 0.1 --criterion d-optimal",
             dict(starts=2, no_slow=True, margin=0.1, criterion="d-optimal")),
            ("two_link", "--separate stribeck:2,torque_ripple:2 --starts 1 --curve spline --harmonics 3 --periods 1 --period 5",
             dict(separate=["stribeck:2", "torque_ripple:2"], starts=1, curve="spline", harmonics=3, periods=1, period=5.0)),
            (str(folder / "boxes.toml"), f"--cell {cell} --clearance 0.03 --starts 1 --no-slow",
             dict(cell=cell, clearance=0.03, starts=1, no_slow=True)))):
        theirs, ours, report = (folder / f"{name}{number}" for name in ("theirs.csv", "ours.csv", "report.json"))
        subprocess.run([program, "excite", "--robot", robot, *words.split(), "--search-seconds", "600", "--out", theirs, "--json", report],
                       check=True, capture_output=True)
        shares = []
        found = armcal.excite(armcal.Robot(robot), **options, seconds=600, out=ours, progress=shares.append)
        motion = [found.pop(key) for key in ("time", "position", "velocity", "acceleration")]
        expected = json.loads(report.read_text())
        expected.pop("file")
        assert found == expected, [key for key in expected if found.get(key) != expected[key]]
        assert ours.read_bytes() == theirs.read_bytes()
        assert shares == sorted(shares) and shares[-1] == 1, shares
        assert found["collisions_checked"] == ("cell" in options)
        t, q, v, a = motion
        written = np.loadtxt(theirs, delimiter=",", skiprows=1)
        assert all(one.dtype == np.float64 and one.flags.c_contiguous for one in motion)
        assert np.allclose(t, written[:, 0], rtol=0, atol=1e-9) and np.allclose(q, written[:, 1:], rtol=1e-12, atol=1e-12)
        assert v.shape == a.shape == q.shape == (t.size, armcal.Robot(robot).joints)
        # Between two points a cubic: so these two sums are exact.
        h, largest = found["step_s"], np.abs(a).max()
        assert np.abs(np.diff(v, axis=0) - h / 2 * (a[1:] + a[:-1])).max() < 1e-9 * largest
        assert np.abs(np.diff(q, axis=0) - h / 2 * (v[1:] + v[:-1]) + h**2 / 12 * np.diff(a, axis=0)).max() < 1e-12 * largest
        assert np.all(v[[0, -1]] == 0)
        print(f"{robot} {words.split()[0]}: cond {found['cond_period']:.4f}, {t.size} points, {len(shares)} shares")
    robot = armcal.Robot("two_link")
    for bad, begin in ((dict(purpose="training"), "purpose: expected one of train, test"), (dict(starts=0), "starts: "),
                       (dict(periods=0), "periods: "), (dict(seconds=-1.0), "seconds: "), (dict(margin=np.nan), "margin: "),
                       (dict(step=1.0), "step: "), (dict(seed=-1), "seed: "), (dict(from_="x.json"), "from_: expected separate"),
                       (dict(separate=["stribeck"], criterion="friction"), "separate: expected no criterion"),
                       (dict(progress=3), "progress: expected a callable")):
        refused(ValueError, begin, lambda: armcal.excite(robot, **bad))
    refused(armcal.InputError, "stribek: no effect", lambda: armcal.excite(robot, separate=["stribek"]))
    refused(armcal.InputError, "", lambda: armcal.excite(robot, cell=folder / "no_such.toml"))
    refused(armcal.InputError, str(folder), lambda: armcal.excite(robot, out=folder, seconds=600))


def with_boxes(text):
    """The arm with a collision shape on every link that moves."""
    return text.replace("</inertial>", '</inertial><collision><geometry><box size="0.06 0.06 0.06"/></geometry></collision>')


class Enough(Exception):
    pass


def check_progress(robot, logs):
    """The share rises to 1; the result is the same with and without progress; what progress raises is passed on."""
    for call in (lambda **more: armcal.identify(robot, logs[0], test=logs[1], **more),
                 lambda **more: armcal.diagnose(robot, logs[0], logs[1], **more)):
        shares = []
        told, untold = call(progress=shares.append), call()
        assert shares == sorted(shares) and shares[-1] == 1 and shares[0] >= 0, shares
        told.pop("seconds", None), untold.pop("seconds", None)
        assert told == untold, [key for key in told if told[key] != untold[key]]
        print(f"{len(shares)} shares, {len(set(shares))} of them different")

    def enough(share):
        raise Enough(share)

    def late(share):
        if share > 0.1:
            raise Enough(share)

    for call in (lambda stop: armcal.excite(robot, starts=1000, seconds=600, progress=stop),
                 lambda stop: armcal.identify(robot, logs[0], progress=stop),
                 lambda stop: armcal.evaluate(robot, logs[0], progress=stop),
                 lambda stop: armcal.diagnose(robot, logs[0], logs[1], progress=stop)):
        for stop in (enough, late):
            try:
                call(lambda share: stop(share) if stop is enough else stop(share + 0.1))
            except Enough:
                continue
            raise AssertionError("the exception was lost")
    # A callable may call the package itself.
    inner = []
    armcal.identify(robot, logs[0], progress=lambda share: inner.append(armcal.identify(robot, logs[0])))
    assert inner


def check_threads(robot, logs):
    """Two threads at once: each is told its own shares, and both get what one alone gets."""
    alone, found, tellers = armcal.identify(robot, logs[0]), [None, None], [set(), set()]

    def call(k):
        found[k] = armcal.identify(robot, logs[0], progress=lambda share: tellers[k].add(threading.get_ident()))

    threads = [threading.Thread(target=call, args=(k,)) for k in range(2)]
    for thread in threads:
        thread.start()
    idents = [thread.ident for thread in threads]
    for thread in threads:
        thread.join()
    assert found == [alone, alone] and tellers == [{ident} for ident in idents], (tellers, idents)


INTERRUPTED = """
import signal, sys, armcal
robot, files, call = armcal.Robot(sys.argv[1]), sys.argv[2:4], sys.argv[4]
logs = [armcal.read_log(file) for file in files]
shares, told, told_before = [], [], []
def tell(share):
    shares.append(share), told.append(share)
    if len(told) == 1:
        print("begun", flush=True)
def stop(*_):
    told_before.append(len(told))
    raise KeyboardInterrupt
signal.signal(signal.SIGINT, stop)
try:
    while call == "diagnose":  # however fast the machine is
        shares.clear()
        armcal.diagnose(robot, *logs, progress=tell)
    armcal.excite(armcal.Robot("er20_like"), seconds=600, progress=tell)
except KeyboardInterrupt:
    print("interrupted", shares[-1] < 1, len(told) - told_before[0], flush=True)
"""


# The call ends before its work is done, and it tells nothing more after the signal.
def check_interrupt(robot_file, files):
    for call in ("diagnose", "excite"):
        child = subprocess.Popen([sys.executable, "-W", "ignore", "-c", INTERRUPTED, robot_file, *files, call], stdout=subprocess.PIPE, text=True)
        assert child.stdout.readline() == "begun\n"
        child.send_signal(signal.SIGINT)
        said = child.communicate(timeout=60)[0]
        assert (said, child.returncode) == ("interrupted True 0\n", 0), (said, child.returncode)


def check_paths(folder, robot_file, files):
    robot = armcal.Robot(pathlib.Path(robot_file))
    assert robot.name == armcal.Robot(str(robot_file)).name
    log = armcal.read_log(pathlib.Path(files[0]))
    assert np.array_equal(log.q, armcal.read_log(files[0]).q)
    table = folder / "identified.json"
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        table.write_text(json.dumps(armcal.identify(robot, log)))
        assert armcal.evaluate(robot, log, table=table) == armcal.evaluate(robot, log, table=str(table))
    refused(ValueError, "msg: expected channels", lambda: armcal.read_log(files[0], msg=["a.msg"]))
    refused(armcal.InputError, str(folder / "no.csv"), lambda: armcal.read_log(folder / "no.csv"))


STATUS = """joints = 3
[q]
column = "/array/data[{0}]"
unit = "rad"
[tau]
column = ["/array/data[3]", "/array/data[4]", "/array/data[5]"]
unit = "N*m"
[flag]
column = ["/status/mode", "/status/raw[0]", "/status/raw[1]"]
"""


def check_messages(folder):
    """A recording that does not define one of its messages: msg gives the definition, as --msg does."""
    bag, channels, definition = CHECKOUT / "tests/unit/bags/recordings/types.db3.zst", folder / "map.toml", folder / "Status.msg"
    channels.write_text(STATUS)
    definition.write_text("float32 bus_voltage\nuint16[3] raw\nint8 mode\nbool ready\nfloat64[<=4] spare\nstring<=20 text\n")
    said = []
    for msg in ([], [definition]):
        try:
            said.append(armcal.read_log(bag, channels, msg=msg))
        except armcal.InputError as error:
            said.append(str(error))
    assert "no definition of my_robot/msg/Status" in said[0] and "no definition" not in str(said[1]), said


def check_example(folder):
    """The cells of the notebook run in order, in an interpreter of their own."""
    notebook = json.loads((CHECKOUT / "host_sim" / "python" / "example.ipynb").read_text())
    cells = [cell for cell in notebook["cells"] if cell["cell_type"] == "code"]
    assert all(not cell["outputs"] and cell["execution_count"] is None for cell in cells), "outputs are stored"
    script = folder / "example.py"
    script.write_text("\n\n".join("".join(cell["source"]) for cell in cells) + "\n\n" + TRUTH)
    done = subprocess.run([sys.executable, "-W", "ignore", script.resolve()], cwd=folder, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    print("\n".join(line.split("\r")[-1] for line in done.stdout.split("\n") if line))


TRUTH = """
ripple = [term for term in verdict["terms"] if term["kind"] == "torque_ripple" and term["confirmed"]]
assert [term["joint"] for term in ripple] == [2] and abs(ripple[0]["eta"][0] - PER_RAD) < 0.1, verdict["terms"]
assert before[1] > 3 * NOISE[1] and np.all(after < 1.1 * NOISE), (before, after)
"""


def main():
    program, folder = sys.argv[1], pathlib.Path(sys.argv[2])
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in (("r", urdf("1 1 0")), ("boxes", with_boxes(urdf("1 1 0")))):
        (folder / f"{name}.urdf").write_text(text)
        subprocess.run([program, "import", folder / f"{name}.urdf", "-o", folder / f"{name}.toml", "--overwrite"], check=True, capture_output=True)
    files, logs = [], []
    for seed in (11, 12):
        files.append(str(folder / f"run{seed}.csv"))
        write_csv(files[-1], *run_of_arm(seed))
        logs.append(armcal.read_log(files[-1]))
    check_excite(program, folder)
    check_paths(folder, folder / "r.toml", files)
    check_messages(folder)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        check_progress(armcal.Robot(folder / "r.toml"), logs)
        check_threads(armcal.Robot(folder / "r.toml"), logs)
    check_interrupt(folder / "r.toml", files)
    check_example(folder)
    print("ok")


main()
