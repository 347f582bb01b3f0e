# peers - arms of public collections, from the URDF to a verdict, with no hand editing.
#
#   arms_test.py ARMCAL FOLDER [NAME ...]
# Two collections from PyPI hold the URDFs: example-robot-data and pybullet. Each arm goes through import, generate, excite,
# simulate, record, identify and diagnose, twice. The simulated arm has bodies, friction and rotors of its own. The first
# time nothing else is undeclared: the verdict must be `none`, and the error on the held-out log at most 1.05 times the
# noise of the torque. The second time one effect is undeclared: the verdict must name it on its joint, and nothing on
# another joint, and no contact. Further arms are imported only, and their models made.
import concurrent.futures
import contextlib
import json
import math
import os
import pathlib
import re
import shutil
import subprocess
import sys

FLOOR = 1.05
SAMPLE_TICKS = 8  # a sample is their mean; import writes this number


class Arm:
    def __init__(self, urdf, kinds="", joint=0, effect="", options=()):
        self.urdf, self.kinds, self.joint, self.effect, self.options = urdf, kinds.split(), joint, effect, options


PUBLIC, BULLET = "example-robot-data/robots", "pybullet_data"
THROUGH = {
    "ur5": Arm(f"{PUBLIC}/ur_description/urdf/ur5_robot.urdf", "torque_ripple", 3,
               'kind = "torque_ripple"\nper_motor_turn = 40\nfirst_Nm = 1.5'),
    "panda": Arm(f"{PUBLIC}/panda_description/urdf/panda.urdf", "torque_offset coulomb_asymmetry", 4,
                 'kind = "coulomb_asymmetry"\nforward_ratio = 1.25\nbackward_ratio = 0.75'),
    "kinova": Arm(f"{PUBLIC}/kinova_description/robots/kinova.urdf", "stribeck stribeck_basis", 2,
                  'kind = "stribeck"\nexcess_Nm = 1.5\nspeed_radps = 0.08'),
    "talos": Arm(f"{PUBLIC}/talos_data/robots/talos_left_arm.urdf", "torque_ripple", 4,
                 'kind = "torque_ripple"\nper_motor_turn = 30\nfirst_Nm = 0.5'),
    "baxter": Arm(f"{PUBLIC}/baxter_description/urdf/baxter.urdf", "cable_pack position_torque", 6,
                  'kind = "cable_pack"\nstiffness_Nmprad = 0.6\nstiffening_rad = 0.6', ("--tip", "left_wrist")),
    "iiwa": Arm(f"{BULLET}/kuka_iiwa/model.urdf", "cable_pack position_torque", 6,
                'kind = "cable_pack"\nstiffness_Nmprad = 3\nstiffening_rad = 0.6'),
    "ur3": Arm(f"{PUBLIC}/ur_description/urdf/ur3_gripper.urdf", "presliding_dahl presliding_lugre hysteresis", 2,
               'kind = "presliding_dahl"\nlength_rad = 0.01'),
    "xarm6": Arm(f"{BULLET}/xarm/xarm6_with_gripper.urdf", "torque_offset", 5, 'kind = "torque_offset"\ntorque_Nm = 1'),
}
IMPORTED = {
    "ur10": Arm(f"{PUBLIC}/ur_description/urdf/ur10_joint_limited_robot.urdf"),
    "xarm7": Arm(f"{PUBLIC}/xarm_description/urdf/xarm7.urdf"),
    "z1": Arm(f"{PUBLIC}/z1_description/urdf/z1.urdf"),
    "so101": Arm(f"{PUBLIC}/so_arm_description/urdf/so101.urdf"),
    "centauro": Arm(f"{PUBLIC}/centauro_description/urdf/centauro.urdf", options=("--tip", "arm1_6")),
    "tiago_pro": Arm(f"{PUBLIC}/tiago_pro_description/robots/tiago_pro.urdf",
                     options=("--tip", "arm_left_7_link", "--fixed", "torso_lift_joint")),
    "bullet_panda": Arm(f"{BULLET}/franka_panda/panda.urdf"),
}


class Failed(Exception):
    pass


class Bench:
    """One arm in a folder of its own."""

    def __init__(self, armcal, folder, name):
        self.armcal, self.name, self.folder = armcal, name, folder / name
        shutil.rmtree(self.folder, ignore_errors=True)
        self.folder.mkdir(parents=True)
        self.robot = self.folder / "arm.toml"
        # Compiled drives go to a folder of the test, not to the user's cache.
        self.environment = {**os.environ, "XDG_CACHE_HOME": str(self.folder / "cache")}

    def run(self, *words):
        done = subprocess.run([self.armcal, *map(str, words)], capture_output=True, text=True, env=self.environment)
        if done.returncode != 0:
            raise Failed(f"{self.name}: {words[0]} ended with {done.returncode}: {(done.stderr or done.stdout).strip()[-500:]}")
        return done.stdout

    def imported(self, arm, collections):
        self.run("import", collections[arm.urdf.split("/")[0]] / arm.urdf, "-o", self.robot, *arm.options)
        self.run("generate", "--robot", self.robot, "--out", self.folder / "generated")

    @contextlib.contextmanager
    def drive(self, scenario):
        said = self.folder / "drive.txt"
        with open(said, "a") as errors:
            process = subprocess.Popen([self.armcal, "simulate", "--robot", self.robot, "--scenario", scenario, "--port", "0",
                                        "--storage", scenario.with_suffix(".nor")],
                                       stdout=subprocess.PIPE, stderr=errors, text=True, env=self.environment)
        try:
            line = process.stdout.readline()  # the drive says its address as soon as it listens
            if "listening on " not in line:
                raise Failed(f"{self.name}: the drive ended: {said.read_text()[-500:]}")
            yield line.split("listening on ")[1].strip()
        finally:
            process.terminate()
            process.communicate()

    def logs(self, name, seed, effect):
        scenario = self.folder / f"{name}.toml"
        scenario.write_text(f'title = "{name}"\ntruth_seed = {seed}\nnoise_seed = {seed + 1}\ncommand = "ramp"\n'
                            f"[truth]\nunstated_share = 0.04\n{effect}\n")
        logs = {motion: self.folder / f"{name}_{motion}.csv.gz" for motion in ("train", "test")}
        with self.drive(scenario) as address:
            for motion, log in logs.items():
                self.run("record", "--connect", address, "--robot", self.robot, "--trajectory", self.folder / f"{motion}.csv", "--out", log)
        return ["--robot", self.robot, "--train", logs["train"], "--test", logs["test"]]

    def result(self, verb, logs):
        out = self.folder / f"{verb}.json"
        self.run(verb, *logs, "--json", out)
        return json.loads(out.read_text())


def confirmed(verdict):
    return [term for term in verdict["terms"] if term["confirmed"]]


def said(terms):
    return ", ".join(f"{term['kind']} on {term['joint']}" for term in terms) or "nothing"


def through(armcal, folder, collections, name, seed):
    """Faults, as lines; empty: all is well."""
    arm, bench, faults = THROUGH[name], Bench(armcal, folder, name), []
    bench.imported(arm, collections)
    for motion, number in (("train", 1), ("test", 2)):
        bench.run("excite", "--robot", bench.robot, "--purpose", motion, "--seed", number, "--starts", 6, "--search-seconds", 60,
                  "--out", bench.folder / f"{motion}.csv")
    logs = bench.logs("nothing", seed, "")
    noise = [float(value) for value in re.findall(r"^torque_noise_Nm? = (\S+)", bench.robot.read_text(), re.M)]
    error = bench.result("identify", logs)["held_out"]["rms_moving"]
    ratio = [e * math.sqrt(SAMPLE_TICKS) / n for e, n in zip(error, noise, strict=True)]
    verdict = bench.result("diagnose", logs)
    if verdict["verdict"] != "none":
        faults.append(f"{name}: nothing is undeclared, and the verdict is {verdict['verdict']}: {said(confirmed(verdict))}")
    if max(ratio) > FLOOR:
        faults.append(f"{name}: the held-out error is {max(ratio):.3f} times the noise, at most {FLOOR} asked")
    terms = confirmed(bench.result("diagnose", bench.logs("effect", seed + 10, f"[[effect]]\njoint = {arm.joint}\n{arm.effect}")))
    if not any(term["kind"] in arm.kinds and term["joint"] == arm.joint for term in terms):
        faults.append(f"{name}: {arm.kinds[0]} on joint {arm.joint} is undeclared, and the verdict names {said(terms)}")
    if any(term["joint"] != arm.joint or term["training_only"] for term in terms):
        faults.append(f"{name}: only joint {arm.joint} has an undeclared effect, nothing touches the arm, and the verdict names {said(terms)}")
    print(f"{name}: error / noise {', '.join(f'{r:.3f}' for r in ratio)}; then {said(terms)}", flush=True)
    return faults


def imported(armcal, folder, collections, name, _):
    Bench(armcal, folder, name).imported(IMPORTED[name], collections)
    print(f"{name}: imported", flush=True)
    return []


def main():
    import pybullet_data
    armcal, folder = sys.argv[1], pathlib.Path(sys.argv[2]).resolve()
    share = next(path for path in map(pathlib.Path, sys.path) if (path / "cmeel.prefix/share" / PUBLIC).is_dir())
    collections = {PUBLIC.split("/")[0]: share / "cmeel.prefix/share", BULLET: pathlib.Path(pybullet_data.getDataPath()).parent}
    names = sys.argv[3:] or [*THROUGH, *IMPORTED]
    faults = []

    def one(name):
        try:
            return (through if name in THROUGH else imported)(armcal, folder, collections, name, 101 + 20 * [*THROUGH, *IMPORTED].index(name))
        except Failed as failed:
            return [str(failed)]

    with concurrent.futures.ThreadPoolExecutor(2) as pool:
        for found in pool.map(one, names):
            faults += found
    for line in faults:
        print(line)
    print(f"{len(names)} arms, {len(faults)} faults")
    sys.exit(bool(faults))


if __name__ == "__main__":
    main()
