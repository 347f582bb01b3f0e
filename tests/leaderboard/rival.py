# leaderboard - what the rivals in Python share: logs, speeds from positions, the declared model's columns, least squares.
import gzip
import json
import pathlib
import sys

import numpy as np
import pinocchio

HALF_WINDOWS = (2, 4, 7, 11, 16, 22, 30)  # samples on either side of the one whose speed is derived
FOLDS = 5
CHOICE_SAMPLES = 2000  # for the choice of the window
FIT_SAMPLES = 10000
IGNORED_S = 0.5  # at either end of the held-out log
RANK = 1e-10


class Log:
    """Positions and torques of a log; states by a local cubic, as the truth's noise floor has them."""

    def __init__(self, path, with_torque):
        with gzip.open(path, "rt") as file:
            columns = file.readline().strip().split(",")
            data = dict(zip(columns, np.loadtxt(file, delimiter=",").T))
        joints = sum(name.startswith("q") for name in columns)
        table = lambda name: np.stack([data[f"{name}{j + 1}"] for j in range(joints)], axis=1)
        self.t, self.q = data["t"], table("q")
        self.temperature = table("temp") if "temp1" in columns else None
        self.tau = table("tau") if with_torque else None
        self.step = (self.t[-1] - self.t[0]) / (len(self.t) - 1)

    def thinned(self, most, edge_s=0.0):
        """Numbers of at most so many samples that have a state with every window."""
        edge = max(HALF_WINDOWS[-1], round(edge_s / self.step))
        inner = np.arange(edge, len(self.t) - edge)
        return inner[:: -(-len(inner) // most)]

    def state(self, half, at):
        powers = (np.arange(-half, half + 1) * self.step)[:, None] ** np.arange(4)
        fit = np.linalg.pinv(powers)
        around = self.q[at[:, None] + np.arange(-half, half + 1)]
        return [factor * np.einsum("w,nwj->nj", fit[k], around) for k, factor in enumerate((1, 1, 2))]


class Case:
    def __init__(self, folder):
        folder = pathlib.Path(folder)
        self.settings = json.loads((folder / "case.json").read_text())
        self.robot = json.loads((folder / "robot.json").read_text())
        self.mjcf = str(folder / "arm.xml")
        self.model = pinocchio.buildModelFromMJCF(self.mjcf)
        self.model.gravity.linear = np.array(self.robot["gravity"])
        self.joints = self.model.nv
        self.sign_width = self.settings["declared_model"]["coulomb_smoothing_velocity"]
        self.train = Log(folder / self.settings["files"]["train"], True)

    def sign(self, speed):
        return np.tanh(speed / self.sign_width)

    def columns(self, q, qd, qdd):
        """[samples, joints, parameters]: bodies, then rotor, Coulomb and viscous friction of each joint."""
        n, data = self.joints, self.model.createData()
        out = np.zeros((len(q), n, 13 * n))
        for k in range(len(q)):
            out[k, :, : 10 * n] = pinocchio.computeJointTorqueRegressor(self.model, data, q[k], qd[k], qdd[k])
        for j in range(n):
            out[:, j, 10 * n + 3 * j : 10 * n + 3 * j + 3] = np.stack([qdd[:, j], self.sign(qd[:, j]), qd[:, j]], axis=1)
        return out

    def columns_by_joint(self, log, halves, at):
        """The same, each joint's rows with the speeds of its own window."""
        out = np.empty((len(at), self.joints, 13 * self.joints))
        for half in set(halves):
            own = [j for j in range(self.joints) if halves[j] == half]
            out[:, own] = self.columns(*log.state(half, at))[:, own]
        return out


def folds(samples):
    """Blocks of neighbours: (training, left out)."""
    block = np.arange(samples) * FOLDS // samples
    return [(block != f, block == f) for f in range(FOLDS)]


def solve(columns, tau, weights):
    """Least squares over all joints; directions that the motion does not show stay at zero."""
    p = columns.shape[2]
    weighted = (columns * weights[:, None]).reshape(-1, p)
    normal = weighted.T @ weighted
    scale = 1 / np.sqrt(np.maximum(np.diag(normal), 1e-24))
    values, vectors = np.linalg.eigh(normal * scale * scale[:, None])
    kept = values > RANK * values[-1]
    right = scale * (weighted.T @ (tau * weights).reshape(-1))
    return scale * (vectors[:, kept] @ ((vectors[:, kept].T @ right) / values[kept]))


def weighted_fit(columns, tau):
    """Each joint weighs as its own error tells; the first pass takes its torque for that."""
    weights = 1 / tau.std(axis=0)
    for _ in range(3):
        x = solve(columns, tau, weights)
        weights = 1 / (tau - columns @ x).std(axis=0)
    return x, weights


def window_errors(case):
    """[windows, joints]: mean square error of the declared model on blocks of the training log that it was not fitted to."""
    at = case.train.thinned(CHOICE_SAMPLES)
    tau, errors = case.train.tau[at], []
    for half in HALF_WINDOWS:
        columns = case.columns(*case.train.state(half, at))
        weights = weighted_fit(columns, tau)[1]
        left = np.empty_like(tau)
        for fit, out in folds(len(at)):
            left[out] = tau[out] - columns[out] @ solve(columns[fit], tau[fit], weights)
        errors.append((left**2).mean(axis=0))
    return np.array(errors)


def choose_windows(case):
    return [HALF_WINDOWS[k] for k in window_errors(case).argmin(axis=0)]


def choose_window(case):
    """One for all joints, of a program that takes one state a sample."""
    return HALF_WINDOWS[np.log(window_errors(case)).sum(axis=1).argmin()]


def main(fit):
    """fit(case) sees the training log alone. It returns predict(log, at) and terms."""
    folder, out = sys.argv[1:]
    case = Case(folder)
    predict, terms = fit(case)
    test = Log(pathlib.Path(folder) / case.settings["files"]["test"], True)
    at, tau = test.thinned(10**9, IGNORED_S), test.tau
    test.tau = None
    after = np.sqrt(((tau[at] - predict(test, at)) ** 2).mean(axis=0))
    pathlib.Path(out).write_text(json.dumps({"after": after.tolist(), "terms": terms, "payload": None}, indent=1))
