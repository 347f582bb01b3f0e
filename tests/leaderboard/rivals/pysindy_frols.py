# row: PySINDy 2.1.0 | least squares, then FROLS over some 80 forms of speed, position, load and temperature on what each joint leaves; number of forms by cross-validation
import numpy as np
import pysindy
import rival

COUNTS = (1, 2, 3, 5)  # of forms on a joint
SAMPLES = 4000
ERRORS_APART = 2  # standard errors by which the forms must gain on blocks left out
FREE = 0.01  # of a form's RMS: what the declared model must not be able to take up


def forms(case, log, at, speeds, load, j):
    """[(what the form may be called, its signal, its values)] for one joint."""
    q, v, me = log.q[at], speeds, j + 1
    speed, sign, limit = v[:, j], case.sign(v[:, j]), case.robot["vmax"][j]
    out = []
    add = lambda kinds, signal, values: out.append((kinds, signal, values))
    for share in (0.003, 0.01, 0.03, 0.1, 0.3):
        add(["stribeck", "friction_exponential", "stribeck_basis"], f"qd{me}", sign * np.exp(-np.abs(speed) / (share * limit)))
    add(["viscous_cuberoot", "stribeck"], f"qd{me}", np.cbrt(speed))
    add(["viscous_quadratic", "viscous_cubic"], f"qd{me}", speed * np.abs(speed))
    add(["viscous_cubic", "viscous_quadratic"], f"qd{me}", speed**3)
    add(["viscous_asymmetry"], f"qd{me}", np.abs(speed))
    add(["torque_offset", "coulomb_asymmetry"], f"qd{me}", np.ones(len(q)))
    for k in (1, 2, 3):
        for wave in (np.sin(k * q[:, j]), np.cos(k * q[:, j])):
            add(["position_torque", "gravity_spring", "cable_pack"], f"q{me}", wave)
            add(["position_friction"], f"q{me}", sign * wave)
            add(["position_viscous"], f"q{me}", speed * wave)
    add(["load_friction"], f"load{me}", sign * np.abs(load[:, j]))
    add(["curve_load_viscous"], f"load{me}", speed * np.abs(load[:, j]))
    add(["torque_gain_error", "load_linear"], f"load{me}", load[:, j])
    add(["curve_load"], f"load{me}", np.abs(load[:, j]))
    add(["time_delay"], f"load{me}", np.gradient(load[:, j], log.t[at]))
    for i in range(case.joints):
        if i != j:
            add(["velocity_product"], f"qd{i + 1}", speed * v[:, i])
            add(["coupled_friction", "wrist_coupling"], f"qd{i + 1}", case.sign(v[:, i]))
            add(["wrist_coupling", "coupled_friction"], f"qd{i + 1}", v[:, i])
            for wave in (np.sin(q[:, i]), np.cos(q[:, i])):
                add(["cross_ripple"], f"q{i + 1}", wave)
                add(["curve_cross_friction"], f"q{i + 1}", sign * wave)
            add(["curve_cross_load"], f"load{i + 1}", sign * np.abs(load[:, i]))
    if log.temperature is not None:
        warm = (log.temperature[at, j] - 25) / 10
        add(["temp_coulomb"], f"temp{me}", sign * warm)
        add(["temp_viscous"], f"temp{me}", speed * warm)
    return out


def select(y, matrix):
    """Coefficients of the forms that FROLS keeps, and the gain in log likelihood; zeros unless they help on blocks left out."""
    # FROLS takes one form after the other. A threshold on coefficients (STLSQ) fails here: many forms are nearly collinear.
    def fitted(rows, count):
        return pysindy.FROLS(max_iter=count, kappa=None).fit(matrix[rows], y[rows, None]).coef_[0]

    blocks = rival.folds(len(y))
    none = np.array([(y[out] ** 2).mean() for _, out in blocks])
    errors = np.array([[((y[out] - matrix[out] @ fitted(rows, count)) ** 2).mean() for rows, out in blocks] for count in COUNTS])
    spread = lambda gains: gains.std(ddof=1) / np.sqrt(len(gains))
    best = errors.mean(axis=1).argmin()
    fewest = min(k for k in range(len(COUNTS)) if (errors[k] - errors[best]).mean() <= spread(errors[k] - errors[best]))
    gain = none - errors[fewest]
    if gain.mean() <= ERRORS_APART * spread(gain):
        return np.zeros(matrix.shape[1]), 0.0
    return fitted(slice(None), COUNTS[fewest]), len(y) * np.log(none.mean() / errors[fewest].mean())


def fit(case):
    halves, n = rival.choose_windows(case), case.joints

    def declared(log, at):
        columns = case.columns_by_joint(log, halves, at)
        speeds = np.stack([log.state(half, at)[1][:, j] for j, half in enumerate(halves)], axis=1)
        return columns, speeds

    def load_of(columns):  # without friction
        bare = x.copy()
        bare[10 * n + 1 :: 3] = bare[10 * n + 2 :: 3] = 0
        return columns @ bare

    at = case.train.thinned(SAMPLES)
    columns, speeds = declared(case.train, at)
    tau = case.train.tau[at]
    x, weights = rival.weighted_fit(columns, tau)
    left, load = tau - columns @ x, load_of(columns)
    kept, terms = [], []
    for j in range(n):
        named = forms(case, case.train, at, speeds, load, j)
        values = np.stack([value for _, _, value in named], axis=1)
        free = values - columns[:, j] @ np.linalg.lstsq(columns[:, j], values, rcond=1e-8)[0]
        size = np.sqrt((free**2).mean(axis=0))
        able = np.flatnonzero(size > FREE * np.sqrt((values**2).mean(axis=0)))
        y = left[:, j] / left[:, j].std()
        coefficients, score = select(y, free[:, able] / size[able])
        found = np.flatnonzero(coefficients)
        if len(found) == 0:
            continue
        kept.append((j, able[found]))
        kinds, signal, _ = named[able[found[np.abs(coefficients[found]).argmax()]]]
        terms.append({"kind": kinds[0], "also_fits": kinds[1:], "joint": j + 1, "signals": [signal], "confirmed": True,
                      "score": score, "parameters": {}, "parameter_sd": {}})

    def extended(columns, log, at, speeds):
        load = load_of(columns)
        more = np.zeros((len(at), n, sum(len(found) for _, found in kept)))
        column = 0
        for j, found in kept:
            named = forms(case, log, at, speeds, load, j)
            for k in found:
                more[:, j, column] = named[k][2]
                column += 1
        return np.concatenate([columns, more], axis=2)

    whole = rival.solve(extended(columns, case.train, at, speeds), tau, weights)

    def predict(log, rows):
        columns, speeds = declared(log, rows)
        return extended(columns, log, rows, speeds) @ whole

    return predict, sorted(terms, key=lambda term: -term["score"])


rival.main(fit)
