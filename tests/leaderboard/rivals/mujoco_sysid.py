# row: MuJoCo 4.0.0, sysid | all ten numbers of each body, rotors, viscous and Coulomb friction, on inverse dynamics of 1000 samples, at most 20 evaluations; window of the speeds by cross-validation
import mujoco
import numpy as np
import rival
from mujoco import sysid

SAMPLES = 1000  # each costs a call of the inverse dynamics for every parameter and iteration
ITERATIONS = 20
CONVERGED = 1e-4  # relative change of the cost


def fit(case):
    half, n = rival.choose_window(case), case.joints
    spec = mujoco.MjSpec.from_file(case.mjcf)
    model = spec.compile()
    params = sysid.ParameterDict()
    for body in spec.bodies[1:]:
        def write_body(spec, param, name=body.name):
            sysid.apply_body_inertia(spec, name, param)
            spec.body(name).iquat = [1, 0, 0, 0]  # the toolbox leaves NaN, which its compiler refuses in these bodies

        params.add(sysid.body_inertia_param(spec, model, body.name, sysid.InertiaType.Pseudo, modifier=write_body))
    # Starts and bounds of the rest come from the torque that the training log shows.
    at = case.train.thinned(SAMPLES)
    state, measured = case.train.state(half, at), case.train.tau[at]
    tau, speed, acceleration = measured.std(axis=0), state[1].std(axis=0), state[2].std(axis=0)
    for j, joint in enumerate(spec.joints):
        def write_joint(spec, param, name=joint.name):
            spec.joint(name).armature, damping = param.value
            spec.joint(name).damping[0] = damping

        start = 0.02 * tau[j] / np.array([acceleration[j], speed[j]])
        params.add(sysid.Parameter(f"joint{j}", start, 0 * start, 100 * start, modifier=write_joint))
        # MuJoCo's friction loss is a soft constraint, and the declared model smooths the sign
        params.add(sysid.Parameter(f"coulomb{j}", 0.02 * tau[j], 0, 2 * tau[j]))

    def torque(params, state):
        built = sysid.apply_param_modifiers(params, spec)
        built.opt.gravity = case.robot["gravity"]
        built.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
        data = mujoco.MjData(built)
        out = np.empty_like(state[0])
        for k, (q, qd, qdd) in enumerate(zip(*state)):
            data.qpos[:], data.qvel[:], data.qacc[:] = q, qd, qdd
            mujoco.mj_inverse(built, data)
            out[k] = data.qfrc_inverse
        coulomb = np.array([params[f"coulomb{j}"].value[0] for j in range(n)])
        return out + coulomb * case.sign(state[1])

    weights = 1 / np.sqrt(rival.window_errors(case).min(axis=0))

    def residual(x, params):
        params.update_from_vector(x)
        return [((torque(params, state) - measured) * weights).ravel()], None, None

    found, _ = sysid.optimize(params, residual, optimizer="scipy", verbose=False, max_iters=ITERATIONS, ftol=CONVERGED, x_scale="jac")
    return lambda log, rows: torque(found, log.state(half, rows)), []


rival.main(fit)
