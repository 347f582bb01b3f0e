# peers - a log of the simulated drive, written by other people's libraries as MCAP, rosbag2, MATLAB and CSV.
#
#   logs_test.py ARMCAL FOLDER
# A drive is simulated and recorded. mcap, rosbags and SciPy write its log. armcal converts each file: all channels must be
# those of the drive to the last bit, and the times equal to 1 us. identify and diagnose must tell the same of each file that
# holds stamps in whole nanoseconds. MATLAB and PlotJuggler hold times as double, up to 0.2 us off: there the terms must be
# the same, parameters within a fifth of their deviation, and errors within 2 %.
import contextlib
import csv
import gzip
import json
import math
import pathlib
import shutil
import socket
import subprocess
import sys
import time

import numpy as np
import scipy.io
from mcap.writer import CompressionType
from mcap_ros2.writer import Writer as McapWriter
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

STAMP = 1_700_000_000_123_456_789
JOINTS = [f"axis_{letter}" for letter in "fbdace"]  # from the base to the tool
JOINT_STATES = """joints = 6
names = ["axis_f", "axis_b", "axis_d", "axis_a", "axis_c", "axis_e"]
[q]
column = "/joint_states/{joint}/position"
unit = "rad"
[tau]
column = "/joint_states/{joint}/effort"
unit = "N*m"
"""
MATLAB = """joints = 6
[time]
column = "t"
unit = "s"
[q]
column = "q(:,{})"
unit = "rad"
[tau]
column = "log.tau({},:)"
unit = "N*m"
"""
PLAIN = MATLAB.replace("q(:,{})", "pos_{0}").replace("log.tau({},:)", "torque_{0}").replace('"t"', '"stamp_ns"').replace('"s"', '"ns"')
DEFINITION = """std_msgs/Header header
string[] name
float64[] position
float64[] velocity
float64[] effort
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
"""


class Log:
    def __init__(self, path):
        with gzip.open(path, "rt") as file:
            rows = list(csv.reader(file))
        self.names = rows[0]
        values = np.array(rows[1:], dtype=float)
        column = lambda word: values[:, [self.names.index(f"{word}{j}") for j in range(1, 7)]]
        self.t, self.q, self.tau = values[:, 0], column("q"), column("tau")
        self.ns = [STAMP + round(1e9 * (at - self.t[0])) for at in self.t]
        random = np.random.default_rng(1)
        self.order = [random.permutation(6) for _ in self.t]
        self.late_ns = random.integers(1_000_000, 3_000_000, len(self.t))


def write_mcap(path, log, compression):
    with open(path, "wb") as file:
        writer = McapWriter(file, compression=compression)
        schema = writer.register_msgdef("sensor_msgs/msg/JointState", DEFINITION)
        for k, order in enumerate(log.order):
            writer.write_message("/joint_states", schema, {
                "header": {"stamp": {"sec": log.ns[k] // 10**9, "nanosec": log.ns[k] % 10**9}, "frame_id": ""},
                "name": [JOINTS[j] for j in order], "position": list(log.q[k, order]), "velocity": [],
                "effort": list(log.tau[k, order])}, int(log.ns[k] + log.late_ns[k]), log.ns[k], k)
        writer.finish()


def write_bag(folder, log, plugin):
    store = get_typestore(Stores.ROS2_HUMBLE)
    kind = "sensor_msgs/msg/JointState"
    shutil.rmtree(folder, ignore_errors=True)
    with Writer(folder, version=8, storage_plugin=plugin) as writer:
        to = writer.add_connection("/joint_states", kind, typestore=store)
        for k, order in enumerate(log.order):
            stamp = store.types["builtin_interfaces/msg/Time"](sec=log.ns[k] // 10**9, nanosec=log.ns[k] % 10**9)
            message = store.types[kind](header=store.types["std_msgs/msg/Header"](stamp=stamp, frame_id=""), name=[JOINTS[j] for j in order],
                                        position=log.q[k, order], velocity=np.array([]), effort=log.tau[k, order])
            writer.write(to, int(log.ns[k] + log.late_ns[k]), bytes(store.serialize_cdr(message, kind)))


def write_csv(path, names, rows):
    with open(path, "w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(names)
        writer.writerows(rows)


def written(folder, name, log):
    """All files of one log: path and map of each."""
    out = {}
    for word, compression in (("none", CompressionType.NONE), ("lz4", CompressionType.LZ4), ("zstd", CompressionType.ZSTD)):
        write_mcap(folder / f"{name}_{word}.mcap", log, compression)
        out[f"MCAP {word}"] = (folder / f"{name}_{word}.mcap", JOINT_STATES)
    write_bag(folder / f"{name}_db3", log, StoragePlugin.SQLITE3)
    out["rosbag2 database"] = (folder / f"{name}_db3", JOINT_STATES)
    write_bag(folder / f"{name}_mcap", log, StoragePlugin.MCAP)
    out["rosbag2 MCAP"] = (folder / f"{name}_mcap", JOINT_STATES)
    scipy.io.savemat(folder / f"{name}.mat", {"t": log.t[:, None], "q": log.q, "log": {"tau": log.tau.T}}, do_compression=True)
    out["MATLAB"] = (folder / f"{name}.mat", MATLAB)
    rows = list(zip(log.ns, log.q, log.tau))
    # PlotJuggler: other topics of the export put rows between, whose cells are empty here.
    exported = []
    for ns, q, tau in rows:
        exported.append([f"{ns / 1e9:.9f}", *map(repr, map(float, q)), *map(repr, map(float, tau)), ""])
        exported.append([f"{ns / 1e9 + 0.001:.9f}", *[""] * 12, "24.5"])
    names = [f"/joint_states/{joint}/{word}" for word in ("position", "effort") for joint in JOINTS]
    write_csv(folder / f"{name}_plotjuggler.csv", ["__time", *names, "/bus/voltage"], exported)
    out["PlotJuggler CSV"] = (folder / f"{name}_plotjuggler.csv", JOINT_STATES)
    names = [f"{word}_{j}" for word in ("pos", "torque") for j in range(6)]
    write_csv(folder / f"{name}_plain.csv", ["stamp_ns", *names], [[ns, *map(repr, map(float, q)), *map(repr, map(float, tau))] for ns, q, tau in rows])
    out["plain CSV"] = (folder / f"{name}_plain.csv", PLAIN)
    return out


def recorded(armcal, folder):
    """Two logs of a simulated drive."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    run = lambda *words: subprocess.run([armcal, *map(str, words)], check=True, capture_output=True)
    for name, purpose in (("a", "train"), ("b", "test")):
        run("excite", "--robot", "er20_like", "--purpose", purpose, "--starts", 4, "--search-seconds", 60, "--out", folder / f"{name}_motion.csv")
    drive = subprocess.Popen([armcal, "simulate", "--scenario", "ripple", "--port", str(port), "--storage", str(folder / "drive.nor")],
                             stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        for _ in range(600):
            with contextlib.suppress(OSError), socket.create_connection(("127.0.0.1", port)):
                break
            time.sleep(0.1)
        for name in "ab":
            run("record", "--robot", "er20_like", "--connect", f"127.0.0.1:{port}", "--trajectory", folder / f"{name}_motion.csv",
                "--out", folder / f"{name}.csv.gz")
    finally:
        drive.terminate()
        drive.wait()
    return folder / "a.csv.gz", folder / "b.csv.gz"


def differences(one, other, at=""):
    """Where two JSON values differ: texts that are not the same, numbers that differ by more than 1e-5."""
    if isinstance(one, dict) and isinstance(other, dict) and one.keys() == other.keys():
        return [line for key in one for line in differences(one[key], other[key], f"{at}.{key}")]
    if isinstance(one, list) and isinstance(other, list) and len(one) == len(other):
        return [line for k, pair in enumerate(zip(one, other)) for line in differences(*pair, f"{at}[{k}]")]
    if isinstance(one, float) and isinstance(other, (int, float)) or isinstance(other, float) and isinstance(one, int):
        return [] if math.isclose(one, other, rel_tol=1e-5, abs_tol=1e-9) else [f"{at}: {one} and {other}"]
    return [] if one == other else [f"{at}: {one} and {other}"]


def told(path):
    """The verdict without what names the files."""
    skipped = {"train", "test", "sha256", "hash", "file", "notes", "held_out_log", "logs", "source", "command", "seconds", "provenance"}
    clean = lambda value: ({k: clean(v) for k, v in value.items() if k not in skipped} if isinstance(value, dict)
                           else [clean(v) for v in value] if isinstance(value, list) else value)
    return clean(json.loads(pathlib.Path(path).read_text()))


def essence(verb, verdict):
    """What a person reads: terms, parameters in units of a fifth of their deviation, errors to 2 %."""
    if verb == "diagnose":
        return [(term["kind"], term["joints"], term["confirmed"]) for term in verdict["terms"]], np.array(verdict["after"]) / 0.02 / np.array(verdict["after"]).max()
    return [column["name"] for column in verdict["columns"]], np.array([column["value"] / (0.2 * column["sd"]) for column in verdict["columns"] if column["sd"] > 0])


def near(verb, one, other):
    texts, numbers = zip(essence(verb, one), essence(verb, other))
    return texts[0] == texts[1] and np.abs(numbers[0] - numbers[1]).max() <= 1


def main(armcal, folder):
    folder = pathlib.Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    run = lambda *words: subprocess.run([armcal, *map(str, words)], check=True, capture_output=True, text=True)
    logs = [Log(path) for path in recorded(armcal, folder)]
    files = [written(folder, name, log) for name, log in zip("ab", logs)]
    reference, bad = {}, []
    for kind in files[0]:
        channels = folder / "map.toml"
        channels.write_text(files[0][kind][1])
        for log, which in zip(logs, files):
            run("convert", which[kind][0], "--channels", channels, "-o", folder / "out.csv.gz")
            with gzip.open(folder / "out.csv.gz", "rt") as file:
                got = np.array(list(csv.reader(file))[1:], dtype=float)
            same = np.array_equal(got[:, 1:7], log.q) and np.array_equal(got[:, 7:13], log.tau)
            late = np.abs(got[:, 0] - (log.t - log.t[0])).max() if len(got) == len(log.t) else math.inf
            print(f"{kind}: channels {'equal' if same else 'DIFFER'}, times differ by {1e6 * late:.3f} us")
            if not same or late > 1e-6:
                bad.append(f"{kind}: conversion")
        for verb in ("identify", "diagnose"):
            run(verb, "--robot", "er20_like", "--train", files[0][kind][0], "--test", files[1][kind][0], "--channels", channels,
                "--json", folder / "out.json")
            verdict = told(folder / "out.json")
            first = reference.setdefault(verb, verdict)
            found = differences(first, verdict)
            allowed = kind in ("MATLAB", "PlotJuggler CSV") and near(verb, first, verdict)
            what = "the same" if not found else "the same within the loss of the times" if allowed else f"{len(found)} differences, such as {found[0]}"
            print(f"{kind}: {verb}: {what}")
            if found and not allowed:
                bad.append(f"{kind}: {verb}")
    return bad


if __name__ == "__main__":
    problems = main(sys.argv[1], sys.argv[2])
    sys.exit("; ".join(problems) if problems else 0)
