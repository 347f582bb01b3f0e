# peers - what armcal export writes, read by MuJoCo and Pinocchio, and computed from the YAML by a recursion of this file.
#
#   exports_test.py ARMCAL FOLDER
# A URDF is imported, other bodies are identified from a log whose torque Pinocchio made, and the arm is exported as URDF,
# MJCF and YAML. At random states the inverse dynamics of all three must agree to 1e-9 of the joint's largest torque. Pinocchio leaves friction and
# damping of a URDF out, and a URDF has no rotors, so the test adds them from the YAML. MuJoCo's friction loss is a soft
# constraint and is not compared.
import pathlib
import subprocess
import sys

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


def compare(armcal, folder, name, slide):
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
    for kind in ("urdf", "mjcf", "yaml"):
        run("export", "--robot", robot, "--table", folder / "table.toml", "--format", kind, "-o", folder / f"out.{kind}")
    arm = yaml.safe_load((folder / "out.yaml").read_text())
    joints = arm["joints"]
    n = len(joints)
    model = mujoco.MjModel.from_xml_path(str(folder / "out.mjcf"))
    data = mujoco.MjData(model)
    model.dof_frictionloss[:] = 0
    pin = reduced(folder / "out.urdf")
    other = pin.createData()
    # The YAML does not say how the arm is mounted: the first body's pose in the MJCF does.
    mounted, first = np.zeros(9), joints[0]["modified_dh"]
    mujoco.mju_quat2Mat(mounted, model.body_quat[1])
    base = mounted.reshape(3, 3) @ (rotation("x", first["alpha_rad"]) @ rotation("z", first["theta_rad"])).T
    random = np.random.default_rng(1)
    torque = {"MuJoCo": [], "Pinocchio": [], "YAML": []}
    for _ in range(STATES):
        q, v, a = (random.uniform(-1.5, 1.5, n) for _ in range(3))
        data.qpos[:], data.qvel[:], data.qacc[:] = q, v, a
        mujoco.mj_inverse(model, data)
        torque["MuJoCo"].append(data.qfrc_inverse.copy())
        more = np.array([rotor(j) for j in joints]) * a + np.array([viscous(j) for j in joints]) * v
        torque["Pinocchio"].append(pinocchio.rnea(pin, other, q, v, a) + more)
        torque["YAML"].append(newton_euler(joints, np.array([0, 0, -9.81]), base, q, v, a) + more)
    reference = np.array(torque["YAML"])
    largest = np.abs(reference).max(axis=0)
    worst = 0.0
    for program in ("MuJoCo", "Pinocchio"):
        error = (np.abs(np.array(torque[program]) - reference).max(axis=0) / largest).max()
        print(f"{name}: {program} and the YAML differ by {error:.1e} of the largest torque")
        worst = max(worst, error)
    return worst <= TOLERANCE


if __name__ == "__main__":
    cases = {"four_turns": False, "with_a_slide": True}
    bad = [name for name, slide in cases.items() if not compare(sys.argv[1], sys.argv[2], name, slide)]
    sys.exit(f"more than {TOLERANCE}: {', '.join(bad)}" if bad else 0)
