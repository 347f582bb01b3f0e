# peers - what armcal export writes, read by MuJoCo, Pinocchio and libsdformat, and computed from the YAML by a recursion
# of this file.
#
#   exports_test.py ARMCAL FOLDER
# A URDF is imported, other bodies are identified from a log whose torque Pinocchio made, and the arm is exported as URDF,
# SDF, MJCF and YAML. SDF and MJCF are also written into given files: the SDF is the URDF as libsdformat converts it, the
# MJCF has other link frames and zeros, and a tool that is welded on. At random states the inverse dynamics of all must
# agree to 1e-9 of the joint's largest torque. Pinocchio leaves friction and damping out, and URDF and SDF have no
# rotors, so the test adds them from the YAML. MuJoCo's friction loss is a soft constraint and is not compared.
import json
import pathlib
import subprocess
import sys
import xml.etree.ElementTree as ElementTree

import mujoco
import numpy as np
import pinocchio
import yaml

STATES = 200
TOLERANCE = 1e-9

LINK = ('<link name="{0}"><inertial><origin xyz="{2}" rpy="{3}"/><mass value="{1}"/><inertia ixx="{4[0]}" ixy="{4[1]}" '
        'ixz="{4[2]}" iyy="{4[3]}" iyz="{4[4]}" izz="{4[5]}"/></inertial></link>\n')
JOINT = ('<joint name="{0}" type="{1}"><parent link="{2}"/><child link="{3}"/><origin xyz="{4}" rpy="{5}"/><axis xyz="{6}"/>'
         '<limit lower="-1.5" upper="1.5" effort="80" velocity="3"/><dynamics damping="0.4" friction="0.7"/>{7}</joint>\n')


def urdf(slide):
    """Four axes that are neither parallel nor square to each other, a flange, and two fingers of which one mimics."""
    inertia = [0.02, 0.001, -0.002, 0.03, 0.0015, 0.025]
    text = '<robot name="r">\n<link name="base"/>\n'
    centers = ["0.05 0.02 0.1", "0.1 0 -0.05", "0 0.08 0.02", "0.03 -0.02 0.06"]
    origins = ["0 0 0.3", "0.2 0 0.1", "0 0.1 0.3", "0.05 0.02 0.2"]
    turns = ["0.4 0 0.1", "0 0.7 0", "0.2 0.3 -1", "1.5707963267948966 0 0"]
    axes = ["0 0.6 0.8", "1 1 0", "0 0 -1", "0 1 0"]
    for k in range(4):
        scaled = [(1 + 0.3 * k) * value for value in inertia]
        text += LINK.format(f"l{k + 1}", 5 - k, centers[k], "0.3 -0.2 0.5", scaled)
        kind = "prismatic" if slide and k == 1 else "revolute"
        text += JOINT.format(f"j{k + 1}", kind, "base" if k == 0 else f"l{k}", f"l{k + 1}", origins[k], turns[k], axes[k], "")
    text += LINK.format("flange", 0.4, "0.01 0 0.03", "0 0 0", [0.1 * value for value in inertia])
    # A frame without mass, with an inertia that others would count.
    text += LINK.format("frame", 0, "0 0 0", "0 0 0", [0.05 * value for value in inertia])
    text += '<joint name="to_frame" type="fixed"><parent link="flange"/><child link="frame"/></joint>\n'
    text += '<joint name="to_flange" type="fixed"><parent link="l4"/><child link="flange"/><origin xyz="0 0 0.1" rpy="0 0 0.9"/></joint>\n'
    for name, mimic in (("f1", ""), ("f2", '<mimic joint="to_f1" multiplier="-1"/>')):
        text += LINK.format(name, 0.2, "0.02 0 0", "0 0 0", [0.01 * value for value in inertia])
        text += JOINT.format("to_" + name, "prismatic", "flange", name, "0 0 0.05", "0 0 0", "0 1 0", mimic)
    return text + "</robot>\n"


def written_log(path, model, seed):
    """60 s of an arm whose bodies are not those of its URDF: torque by Pinocchio, friction and noise added."""
    random = np.random.default_rng(seed)
    data, n = model.createData(), model.nq
    for body in model.inertias.tolist()[1:]:
        body.mass *= random.uniform(0.9, 1.1)
        body.inertia = body.inertia * random.uniform(0.9, 1.1)
    t = np.arange(0, 60, 0.008)
    q, v, a = (np.zeros((len(t), n)) for _ in range(3))
    for j in range(n):
        for h in range(1, 6):
            w, size, phase = 0.2 * np.pi * h, random.uniform(0.2, 0.5) / h, random.uniform(0, 6.28)
            q[:, j] += size * np.sin(w * t + phase)
            v[:, j] += size * w * np.cos(w * t + phase)
            a[:, j] -= size * w * w * np.sin(w * t + phase)
    tau = np.array([pinocchio.rnea(model, data, *row) for row in zip(q, v, a)])
    tau += 0.2 * a + 1.3 * v + 1.1 * np.sign(v) + random.normal(0, 0.1, tau.shape)
    names = ["t"] + [f"q{j + 1}" for j in range(n)] + [f"tau{j + 1}" for j in range(n)]
    np.savetxt(path, np.hstack([t[:, None], q, tau]), delimiter=",", header=",".join(names), comments="", fmt="%.12g")


def rotation(axis, angle):
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[1, 0, 0], [0, c, -s], [0, s, c]] if axis == "x" else [[c, -s, 0], [s, c, 0], [0, 0, 1]])


def newton_euler(arm, gravity, base, q, v, a):
    """tau of an arm in modified DH frames, with rotors and damping."""
    w, dw, acc = np.zeros(3), np.zeros(3), -base.T @ gravity
    z = np.array([0.0, 0, 1])
    state = []
    for j, joint in enumerate(arm):
        dh = joint["modified_dh"]
        slide = joint["type"] == "prismatic"
        theta, d = dh["theta_rad"] + (0 if slide else q[j]), dh["d_m"] + (q[j] if slide else 0)
        R = rotation("x", dh["alpha_rad"]) @ rotation("z", theta)
        p = np.array([dh["a_m"], 0, 0]) + rotation("x", dh["alpha_rad"]) @ np.array([0, 0, d])
        acc = R.T @ (acc + np.cross(dw, p) + np.cross(w, np.cross(w, p)))
        w0, dw0 = R.T @ w, R.T @ dw
        if slide:
            w, dw = w0, dw0
            acc = acc + 2 * np.cross(w, z * v[j]) + z * a[j]
        else:
            w, dw = w0 + z * v[j], dw0 + np.cross(w0, z * v[j]) + z * a[j]
        c, i = np.array(joint["center_m"]), joint["inertia_kgm2"]
        I = np.array([[i["ixx"], i["ixy"], i["ixz"]], [i["ixy"], i["iyy"], i["iyz"]], [i["ixz"], i["iyz"], i["izz"]]])
        F = joint["mass_kg"] * (acc + np.cross(dw, c) + np.cross(w, np.cross(w, c)))
        state.append((R, p, F, I @ dw + np.cross(w, I @ w), c, slide))
    f, n, tau = np.zeros(3), np.zeros(3), np.zeros(len(arm))
    R, p = np.eye(3), np.zeros(3)
    for j in reversed(range(len(arm))):
        f_out = R @ f
        n = state[j][3] + R @ n + np.cross(state[j][4], state[j][2]) + np.cross(p, f_out)
        f = state[j][2] + f_out
        tau[j] = (f if state[j][5] else n) @ z
        R, p = state[j][0], state[j][1]
    return tau


def rotor(joint):
    return joint.get("rotor_inertia_kgm2", joint.get("rotor_inertia_kg", 0.0))


def viscous(joint):
    return joint.get("viscous_Nmsprad", joint.get("viscous_Nspm", 0.0))


def reduced(path):
    """The arm of a URDF, its fingers held at zero."""
    full = pinocchio.buildModelFromUrdf(str(path))
    held = [full.getJointId(joint) for joint in ("to_f1", "to_f2")]
    return pinocchio.buildReducedModel(full, held, pinocchio.neutral(full))


def placed(rotated, moved):
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = rotated, moved
    return T


def words(numbers):
    return " ".join(repr(float(value)) for value in numbers)


def turned(element, R, how):
    """Writes a rotation in one of the ways that MJCF has."""
    for old in ("quat", "axisangle", "xyaxes", "zaxis", "euler"):
        element.attrib.pop(old, None)
    quat = np.zeros(4)
    mujoco.mju_mat2Quat(quat, R.reshape(9))
    if how == 0:
        element.set("xyaxes", words(2.0 * R[:, :2].T.reshape(6)))
    elif how == 1:
        axis = quat[1:] / np.linalg.norm(quat[1:])
        element.set("axisangle", words([*axis, np.degrees(2 * np.arctan2(np.linalg.norm(quat[1:]), quat[0]))]))
    elif how == 2:  # Rx(a) Ry(b) Rz(c)
        b = np.arcsin(R[0, 2])
        element.set("euler", words(np.degrees([np.arctan2(-R[1, 2], R[2, 2]), b, np.arctan2(-R[0, 1], R[0, 0])])))
    else:
        element.set("quat", words(quat))


def with_other_frames(text, seed):
    """The arm of an MJCF file with other link frames, references, classes and weights, and a tool of its own."""
    random = np.random.default_rng(seed)
    root = ElementTree.fromstring(text)
    root.find("compiler").set("angle", "degree")
    root.insert(0, ElementTree.fromstring('<default><default class="own"><joint type="slide" damping="70" armature="3"/></default>'
                                          '<joint axis="0 0 1" frictionloss="9"/></default>'))
    before, k = np.eye(4), 0
    body = root.find("worldbody").find("body")
    while body is not None:
        joint, inertial = body.find("joint"), body.find("inertial")
        R = np.zeros(9)
        mujoco.mju_quat2Mat(R, np.array(list(map(float, body.get("quat").split()))))
        T = placed(R.reshape(3, 3), list(map(float, body.get("pos").split())))
        slides = joint.get("type") == "slide"
        ref = random.uniform(-0.4, 0.4)
        T = T @ (placed(np.eye(3), [0, 0, ref]) if slides else placed(rotation("z", ref), np.zeros(3)))
        G = placed(rotation("x", random.uniform(-3, 3)) @ rotation("z", random.uniform(-3, 3)), random.uniform(-0.2, 0.2, 3))
        own = np.linalg.inv(before) @ T @ G
        body.set("pos", words(own[:3, 3]))
        turned(body, own[:3, :3], k % 4)
        joint.set("pos", words(np.linalg.inv(G)[:3, 3]))
        joint.set("axis", words(3 * G[:3, :3].T @ [0, 0, 1]))
        joint.set("ref", words([ref if slides else np.degrees(ref)]))
        del joint.attrib["type"]
        if slides:
            joint.set("class", "own")
        for value in ("damping", "armature", "frictionloss", "range"):
            joint.attrib.pop(value, None)
        if k == 0:
            body.remove(inertial)
        else:
            inertial.set("mass", "50")
        before, k, last = G, k + 1, body
        body = body.find("body")
    center = np.linalg.inv(before) @ [*map(float, inertial.get("pos").split()), 1]
    last.append(ElementTree.fromstring(f'<frame pos="{words(center[:3])}" euler="20 0 10"><body name="tool" pos="0.02 0 0.01" axisangle="1 1 0 40">'
                                       '<inertial pos="0 0 0.01" mass="0.1" fullinertia="4e-5 3e-5 2e-5 1e-6 2e-6 -1e-6"/></body></frame>'))
    return ElementTree.tostring(root, encoding="unicode")


def by_libsdformat(reader, path, names):
    """A Pinocchio model of the arm that libsdformat reads; joints that have other names are held."""
    read = json.loads(subprocess.run([reader, "read", path], check=True, capture_output=True, text=True).stdout)

    def pose(seven):
        w, x, y, z = seven[3:]
        return pinocchio.SE3(pinocchio.Quaternion(w, x, y, z).matrix(), np.array(seven[:3]))

    links = {link["name"]: link for link in read["link"]}
    model = pinocchio.Model()
    at = {"world": (0, pinocchio.SE3.Identity())}  # link -> joint that moves it, and that joint's frame in the model
    root = ({link for link in links} - {joint["child"] for joint in read["joint"]}).pop() if not any(
        joint["parent"] == "world" for joint in read["joint"]) else "world"
    at[root] = (0, pinocchio.SE3.Identity())
    open_joints = list(read["joint"])
    while open_joints:
        joint = next(one for one in open_joints if one["parent"] in at)
        open_joints.remove(joint)
        number, frame = at[joint["parent"]]
        if joint["name"] in names:
            where = pose(joint["pose"])
            axis = where.rotation.T @ np.array(joint["axis"])
            kind = pinocchio.JointModelPrismaticUnaligned(axis) if joint["slides"] else pinocchio.JointModelRevoluteUnaligned(axis)
            number, frame = model.addJoint(number, kind, frame.inverse() * where, joint["name"]), where
        link = links[joint["child"]]
        i = link["inertia"]
        inertia = pinocchio.Inertia(link["mass"], np.zeros(3), np.array([[i[0], i[1], i[2]], [i[1], i[3], i[4]], [i[2], i[4], i[5]]]))
        if number:
            model.appendBodyToJoint(number, inertia.se3Action(pose(link["inertial_pose"])), frame.inverse() * pose(link["pose"]))
        at[joint["child"]] = (number, frame)
    assert [model.names[k] for k in range(1, model.njoints)] == names
    return model, {joint["name"]: joint for joint in read["joint"]}


def compare(armcal, folder, reader, name, slide):
    folder = pathlib.Path(folder) / name
    folder.mkdir(parents=True, exist_ok=True)

    def run(*words):
        return subprocess.run([armcal, *map(str, words)], check=True, capture_output=True, text=True).stdout

    (folder / "arm.urdf").write_text(urdf(slide))
    robot = folder / "arm.toml"
    run("import", folder / "arm.urdf", "--tip", "flange", "-o", robot, "--overwrite")
    run("generate", "--robot", robot, "--out", folder / "generated")
    written_log(folder / "log.csv", reduced(folder / "arm.urdf"), 7)
    run("identify", "--robot", robot, "--train", folder / "log.csv", "--table-out", folder / "table.toml")

    def export(kind, out, *more):
        run("export", "--robot", robot, "--table", folder / "table.toml", "--format", kind, "-o", folder / out, *more)

    for kind in ("urdf", "sdf", "mjcf", "yaml"):
        export(kind, f"out.{kind}")
    (folder / "given.xml").write_text(with_other_frames((folder / "out.mjcf").read_text(), 3))
    export("mjcf", "into.xml", "--into", folder / "given.xml")
    # libsdformat leaves a root link without weight out, and all that hangs on it.
    weighed = LINK.format("base", 9, "0 0 0", "0 0 0", [1, 0, 0, 1, 0, 1])
    (folder / "weighed.urdf").write_text((folder / "arm.urdf").read_text().replace('<link name="base"/>', weighed))
    subprocess.run([reader, "convert", folder / "weighed.urdf", folder / "given.sdf"], check=True)
    export("sdf", "into.sdf", "--into", folder / "given.sdf")
    arm = yaml.safe_load((folder / "out.yaml").read_text())
    joints = arm["joints"]
    n = len(joints)
    names = [joint["name"] for joint in joints]

    def by_mujoco(path):
        model = mujoco.MjModel.from_xml_path(str(folder / path))
        assert model.nq == n, path
        for k, joint in enumerate(joints):  # the same digits as in the YAML
            assert model.dof_armature[k] == rotor(joint) and model.dof_damping[k] == viscous(joint), path
        model.dof_frictionloss[:] = 0
        data = mujoco.MjData(model)

        def torque(q, v, a):
            data.qpos[:], data.qvel[:], data.qacc[:] = q, v, a
            mujoco.mj_inverse(model, data)
            return data.qfrc_inverse.copy()

        return torque, model

    def by_pinocchio(model):
        data = model.createData()
        drives = np.array([rotor(j) for j in joints]), np.array([viscous(j) for j in joints])
        return lambda q, v, a: pinocchio.rnea(model, data, q, v, a) + drives[0] * a + drives[1] * v

    mjcf, model = by_mujoco("out.mjcf")
    programs = {"MuJoCo": mjcf, "MuJoCo, a given file": by_mujoco("into.xml")[0],
                "Pinocchio, the given URDF": by_pinocchio(reduced(folder / "out.urdf"))}
    for label, path in (("libsdformat", "out.sdf"), ("libsdformat, a given file", "into.sdf")):
        read, of_name = by_libsdformat(reader, folder / path, names)
        for joint in joints:
            assert of_name[joint["name"]]["damping"] == viscous(joint), path
        programs[label] = by_pinocchio(read)
    # The YAML does not say how the arm is mounted: the first body's pose in the MJCF does.
    mounted, first = np.zeros(9), joints[0]["modified_dh"]
    mujoco.mju_quat2Mat(mounted, model.body_quat[1])
    base = mounted.reshape(3, 3) @ (rotation("x", first["alpha_rad"]) @ rotation("z", first["theta_rad"])).T
    random = np.random.default_rng(1)
    torque, reference = {label: [] for label in programs}, []
    for _ in range(STATES):
        q, v, a = (random.uniform(-1.5, 1.5, n) for _ in range(3))
        for label, program in programs.items():
            torque[label].append(program(q, v, a))
        more = np.array([rotor(j) for j in joints]) * a + np.array([viscous(j) for j in joints]) * v
        reference.append(newton_euler(joints, np.array([0, 0, -9.81]), base, q, v, a) + more)
    reference = np.array(reference)
    largest = np.abs(reference).max(axis=0)
    worst = 0.0
    for label in programs:
        error = (np.abs(np.array(torque[label]) - reference).max(axis=0) / largest).max()
        print(f"{name}: {label} and the YAML differ by {error:.1e} of the largest torque")
        worst = max(worst, error)
    return worst <= TOLERANCE


if __name__ == "__main__":
    cases = {"four_turns": False, "with_a_slide": True}
    reader = pathlib.Path(sys.argv[2]) / "sdf_arm"
    reader.parent.mkdir(parents=True, exist_ok=True)
    flags = subprocess.run(["pkg-config", "--cflags", "--libs", "sdformat12"], check=True, capture_output=True, text=True).stdout
    subprocess.run(["g++", "-o", reader, pathlib.Path(__file__).with_name("sdf_arm.cpp"), *flags.split()], check=True)
    bad = [name for name, slide in cases.items() if not compare(*sys.argv[1:3], reader, name, slide)]
    sys.exit(f"more than {TOLERANCE}: {', '.join(bad)}" if bad else 0)
