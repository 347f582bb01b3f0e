# row: FIGAROH 1.0.2 | its regressor with friction and rotors (the sign smoothed as the case says), its double QR, weighted by joint; window of the speeds by cross-validation
from types import SimpleNamespace

import numpy as np
import rival
from figaroh.tools.qrdecomposition import QRDecomposer
from figaroh.tools.regressor import RegressorBuilder, RegressorConfig

SAMPLES = 4000  # its second QR holds all rows at once


def fit(case):
    half, n = rival.choose_window(case), case.joints
    arm = SimpleNamespace(model=case.model, data=case.model.createData())
    builder = RegressorBuilder(arm, RegressorConfig(has_friction=True, has_actuator_inertia=True))

    def regressor(log, at):  # rows of joint 1, then those of joint 2
        state = log.state(half, at)
        rows = builder.build_basic_regressor(*state, {"act_idxv": list(range(n))})
        for j in range(n):
            rows[j * len(at) : (j + 1) * len(at), 11 * n + j] = case.sign(state[1][:, j])
        return rows

    at = case.train.thinned(SAMPLES)
    full, tau = regressor(case.train, at), case.train.tau[at].T.reshape(-1)
    shown = np.flatnonzero((full**2).sum(axis=0) > 1e-6)
    names = [f"p{k}" for k in shown]
    weights = np.repeat(1 / case.train.tau[at].std(axis=0), len(at))
    for _ in range(3):
        qr = QRDecomposer()
        base = qr.double_decomposition(tau * weights, full[:, shown] * weights[:, None], names)[3]
        columns = shown[qr.base_indices]
        left = (tau - full[:, columns] @ base).reshape(n, -1)
        weights = np.repeat(1 / left.std(axis=1), len(at))
    return lambda log, rows: (regressor(log, rows)[:, columns] @ base).reshape(n, -1).T, []


rival.main(fit)
