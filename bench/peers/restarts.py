"""A restart loop for peers that only take steps: pin-pink and mink give a step, a user writes the loop around it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from protocol import Job, Values

# Below the judge's 1e-5, so that its rounding does not decide.
TOLERANCE = 9e-6
MAX_STARTS = 50
MAX_STEPS = 30
SEED = 7
SETTINGS = (
    f"our loop: full steps until the error of position and of rotation is below {TOLERANCE:g}, "
    f"at most {MAX_STEPS} a start, at most {MAX_STARTS} starts (the middle, then random ones)"
)


def solve_with_restarts(
    job: Job,
    begin: Callable[[np.ndarray], Any],
    error: Callable[[Any], np.ndarray],
    step: Callable[[Any], Any | None],
    values: Callable[[Any], Values],
) -> tuple[Values, bool]:
    """Steps from the middle of the ranges, then from random values inside them.

    `begin` makes a state from joint values, `error` gives its six numbers (metres, radians), `step` the next state or
    nothing where the peer found no step, `values` the joint values of a state.
    """
    lower, upper = np.array(job.lower), np.array(job.upper)
    random = np.random.default_rng(SEED)
    best: tuple[float, Values] = (np.inf, job.middle())
    for start in range(MAX_STARTS):
        state = begin((lower + upper) / 2 if start == 0 else random.uniform(lower, upper))
        for _ in range(MAX_STEPS + 1):
            twist = error(state)
            worst = max(np.linalg.norm(twist[:3]), np.linalg.norm(twist[3:]))
            if worst < best[0]:
                best = (worst, values(state))
            if worst < TOLERANCE:
                return values(state), True
            following = step(state)
            if following is None:
                break
            state = following
    return best[1], False
