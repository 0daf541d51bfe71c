"""Pink on the Panda: differential inverse kinematics by quadratic programs over Pinocchio, in our loop of steps."""

from __future__ import annotations

import numpy as np
import pink
import pinocchio as pin
from pink.limits import ConfigurationLimit
from pink.tasks import FrameTask

from protocol import Job, System, Values, main
from restarts import SETTINGS, solve_with_restarts

# Best of those tried (lm_damping 0 to 0.3, limit gain 0.5 and 0.95, with and without its velocity limit).
LM_DAMPING = 0.1
LIMIT_GAIN = 0.95
QP_SOLVER = "daqp"


def chain_of(job: Job) -> pin.Model:
    """The arm alone: every joint outside of the chain is locked, since it would only cost time."""
    whole = pin.buildModelFromUrdf(job.rig)
    outside = [whole.getJointId(name) for name in whole.names[1:] if name not in job.joints]
    model = pin.buildReducedModel(whole, outside, pin.neutral(whole))
    if list(model.names[1:]) != job.joints:
        raise ValueError(f"found the joints {list(model.names[1:])}, expected {job.joints}")
    return model


def systems(job: Job) -> list[System]:
    """One line: a frame task with Levenberg–Marquardt damping and the configuration limit."""
    model = chain_of(job)
    data = model.createData()
    limits = [ConfigurationLimit(model, config_limit_gain=LIMIT_GAIN)]
    task = FrameTask(job.tip, position_cost=1.0, orientation_cost=1.0, lm_damping=LM_DAMPING)

    def begin(values: np.ndarray) -> pink.Configuration:
        return pink.Configuration(model, data, values, copy_data=False)

    def step(state: pink.Configuration) -> pink.Configuration | None:
        try:
            velocity = pink.solve_ik(state, [task], 1.0, solver=QP_SOLVER, limits=limits, safety_break=False)
        except pink.exceptions.PinkError:
            return None
        state.integrate_inplace(velocity, 1.0)
        return state

    def solve(target: list[list[float]]) -> tuple[Values, bool]:
        task.set_target(pin.SE3(np.array(target)))
        return solve_with_restarts(job, begin, lambda state: task.compute_error(state), step, lambda state: state.q)

    settings = f"{QP_SOLVER}, lm_damping {LM_DAMPING}, limit gain {LIMIT_GAIN}, no velocity limit; {SETTINGS}"
    return [System("pin-pink", settings, solve)]


if __name__ == "__main__":
    main("pin-pink", systems)
