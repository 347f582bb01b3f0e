# bags tests - writes drive.csv, a part of a log of the simulated drive, in the formats that robots record, with other
# people's libraries. The tests compare what armcal reads with drive.csv.
#
#   pip install mcap==1.6.0 mcap-ros2-support==0.6.0 rosbags==0.11.9 scipy==1.17.1 h5py==3.16.0 && python write.py
#   npm install @mcap/core@2.2.2 && node write.mjs
#
# header.stamp is the time of drive.csv, counted from STAMP. The recorder sees a message up to 3 ms later.
import contextlib
import pathlib
import random
import shutil
import sqlite3

import h5py
import numpy as np
import scipy.io
import zstandard
from mcap.writer import CompressionType
from mcap_ros2.writer import Writer as McapWriter
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

HERE = pathlib.Path(__file__).parent
STAMP = 1_700_000_000_123_456_789
JOINTS = ["shoulder", "elbow", "wrist"]

table = np.genfromtxt(HERE / "drive.csv", delimiter=",", names=True)
rows = np.array(table.tolist())
t, q, tau = rows[:, 0], rows[:, 1:4], rows[:, 4:7]
header_ns = [STAMP + round(1e9 * (at - t[0])) for at in t]
random.seed(3)
recorded_ns = [stamp + 1_000_000 + random.randrange(2_000_000) for stamp in header_ns]

store = get_typestore(Stores.ROS2_HUMBLE)
store.register(get_types_from_msg("string[] interface_names\nfloat64[] values", "control_msgs/msg/InterfaceValue"))
store.register(get_types_from_msg("std_msgs/Header header\nstring[] joint_names\ncontrol_msgs/InterfaceValue[] interface_values",
                                  "control_msgs/msg/DynamicJointState"))
store.register(get_types_from_msg("float32 bus_voltage\nuint16[3] raw\nint8 mode\nbool ready\nfloat64[<=4] spare\nstring<=20 text",
                                  "my_robot/msg/Status"))
JOINT_STATE = """std_msgs/Header header
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


def orders():
    """The joints of each message, in an order that changes."""
    shuffled = random.Random(5)
    for _ in t:
        order = [0, 1, 2]
        shuffled.shuffle(order)
        yield order


def write_mcap(name, compression):
    with open(HERE / name, "wb") as file:
        writer = McapWriter(file, chunk_size=8192, compression=compression)
        schema = writer.register_msgdef("sensor_msgs/msg/JointState", JOINT_STATE)
        for k, order in enumerate(orders()):
            stamp = {"sec": header_ns[k] // 10**9, "nanosec": header_ns[k] % 10**9}
            message = {"header": {"stamp": stamp, "frame_id": "base"[: k % 5]}, "name": [JOINTS[j] for j in order],
                       "position": [q[k, j] for j in order], "velocity": [], "effort": [tau[k, j] for j in order]}
            writer.write_message("/joint_states", schema, message, recorded_ns[k], recorded_ns[k], k)
        writer.finish()


def header(k):
    time = store.types["builtin_interfaces/msg/Time"](sec=header_ns[k] // 10**9, nanosec=header_ns[k] % 10**9)
    return store.types["std_msgs/msg/Header"](stamp=time, frame_id="base")


def joint_state(k, order):
    return store.types["sensor_msgs/msg/JointState"](header=header(k), name=[JOINTS[j] for j in order], position=q[k, order],
                                                     velocity=np.array([]), effort=tau[k, order])


def write_bag(name, parts, plugin=StoragePlugin.SQLITE3, version=8, little=True, split=1):
    """parts: topic, type, rows, message of a row."""
    folder = HERE / name
    shutil.rmtree(folder, ignore_errors=True)
    for piece in range(split):
        at = folder if split == 1 else HERE / f"{name}_piece{piece}"
        shutil.rmtree(at, ignore_errors=True)
        with Writer(at, version=version, storage_plugin=plugin) as writer:
            for topic, kind, which, message in parts:
                to = writer.add_connection(topic, kind, typestore=store)
                for k in which:
                    if split * k // len(t) == piece:
                        writer.write(to, recorded_ns[k], bytes(store.serialize_cdr(message(k), kind, little_endian=little)))


order = list(orders())
whole = [("/joint_states", "sensor_msgs/msg/JointState", range(len(t)), lambda k: joint_state(k, order[k]))]


def dynamic(k):
    value = store.types["control_msgs/msg/InterfaceValue"]
    return store.types["control_msgs/msg/DynamicJointState"](
        header=header(k), joint_names=[JOINTS[j] for j in order[k]],
        interface_values=[value(interface_names=["effort", "position"], values=np.array([tau[k, j], q[k, j]])) for j in order[k]])


def array(k):
    layout = store.types["std_msgs/msg/MultiArrayLayout"](dim=[], data_offset=0)
    return store.types["std_msgs/msg/Float64MultiArray"](layout=layout, data=np.concatenate((q[k], tau[k])))


def wrench(k):
    vector = store.types["geometry_msgs/msg/Vector3"]
    value = store.types["geometry_msgs/msg/Wrench"](force=vector(x=tau[k, 0], y=tau[k, 1], z=tau[k, 2]), torque=vector(x=1, y=2, z=3))
    return store.types["geometry_msgs/msg/WrenchStamped"](header=header(k), wrench=value)


def twist(k):
    vector = store.types["geometry_msgs/msg/Vector3"]
    value = store.types["geometry_msgs/msg/Twist"](linear=vector(x=q[k, 0], y=q[k, 1], z=q[k, 2]), angular=vector(x=4, y=5, z=6))
    return store.types["geometry_msgs/msg/TwistStamped"](header=header(k), twist=value)


def status(k):
    return store.types["my_robot/msg/Status"](bus_voltage=48.5, raw=np.array([1, 2, 65535], np.uint16), mode=-3, ready=True,
                                              spare=np.array([tau[k, 0]]), text="ok" * (k % 4))


for name, compression in (("none", CompressionType.NONE), ("lz4", CompressionType.LZ4), ("zstd", CompressionType.ZSTD)):
    write_mcap(f"joint_states_{name}.mcap", compression)
write_bag("plain", whole)
write_bag("big_endian", whole, version=9, little=False)

# Topics of five types; the wrench comes at half the rate.
every, half = range(len(t)), range(0, len(t), 2)
write_bag("types", [("/dynamic", "control_msgs/msg/DynamicJointState", every, dynamic), ("/array", "std_msgs/msg/Float64MultiArray", every, array),
                    ("/ft", "geometry_msgs/msg/WrenchStamped", half, wrench), ("/tcp", "geometry_msgs/msg/TwistStamped", every, twist),
                    ("/status", "my_robot/msg/Status", every, status)])

# A recording in two files, as rosbag2 splits one: the second one compressed.
write_bag("split", whole, split=2)
split = HERE / "split"
shutil.rmtree(split, ignore_errors=True)
split.mkdir()
first, second = (next((HERE / f"split_piece{k}").glob("*.db3")) for k in (0, 1))
shutil.move(first, split / "split_0.db3")
(split / "split_1.db3.zstd").write_bytes(zstandard.compress(second.read_bytes()))
(split / "metadata.yaml").write_text("rosbag2_bagfile_information:\n  version: 8\n  relative_file_paths:\n    - split_0.db3\n"
                                     "    - split_1.db3.zstd\n  duration:\n    nanoseconds: 1\n")
for k in (0, 1):
    shutil.rmtree(HERE / f"split_piece{k}")

# One database of each bag is enough for the tests, compressed to save room.
for name in ("plain", "big_endian", "types"):
    database = next((HERE / name).glob("*.db3"))
    if name != "big_endian":  # as ROS 2 Humble writes it
        with contextlib.closing(sqlite3.connect(database, isolation_level=None)) as bag:
            bag.execute("DROP TABLE message_definitions")
            bag.execute("VACUUM")
    (HERE / f"{name}.db3.zst").write_bytes(zstandard.compress(database.read_bytes(), 19))
    shutil.rmtree(HERE / name)

scipy.io.savemat(HERE / "drive_5.mat", {"t": t[:, None], "q": q, "log": {"torque": tau.T, "note": "simulated"}}, do_compression=True)
scipy.io.savemat(HERE / "drive_4.mat", {"t": t[:, None], "q": q, "tau": tau}, format="4")

# Version 7.3 is HDF5 behind a header of 512 bytes; a matrix lies there transposed.
with h5py.File(HERE / "drive_73.mat", "w", userblock_size=512) as file:
    for name, value in (("t", t[:, None]), ("q", q), ("tau", tau)):
        kind = h5py.h5t.C_S1.copy()
        kind.set_size(6)
        kind.set_strpad(h5py.h5t.STR_NULLTERM)
        dataset = file.create_dataset(name, data=value.T)
        of_class = h5py.h5a.create(dataset.id, b"MATLAB_class", kind, h5py.h5s.create(h5py.h5s.SCALAR))
        of_class.write(np.array(b"double", dtype="S6"), mtype=kind)
hdf5 = bytearray((HERE / "drive_73.mat").read_bytes())
hdf5[:128] = b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM"
(HERE / "drive_73.mat").write_bytes(hdf5)

# Classes of numbers, a 1 x 7 row, what is missing, and what Simulink writes: a struct of signals.
seven = np.arange(7)
signals = np.array([(np.stack([10 * seven, 10 * seven + 1])[:, None, :],), (100 * seven[:, None],)], dtype=[("values", object)])
holes = seven[None, :] * 1.0
holes[0, 2:4] = np.nan, np.inf
kinds = {"single": (0.5 * seven[:, None]).astype(np.float32), "whole": -seven[:, None].astype(np.int16), "holes": holes,
         "text": "no numbers", "complex": seven[:, None] * 1j, "short": seven[:3, None], "out": {"signals": signals}}
scipy.io.savemat(HERE / "kinds.mat", kinds)
scipy.io.savemat(HERE / "kinds_4.mat", {name: kinds[name] for name in ("single", "holes", "short")}, format="4")
