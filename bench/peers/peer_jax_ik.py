"""jax-ik on the reference human: Adam over compiled JAX code, for the fingertip alone and with its look objective."""

from __future__ import annotations

import math
from collections.abc import Callable

import jax.numpy as jnp
import numpy as np
from jax.tree_util import register_pytree_node_class
from jax_ik.ik import InverseKinematicsSolver
from jax_ik.objectives import BoneRelativeLookObj, DistanceObjTraj, ObjectiveFunction

from protocol import Job, System, Values, main

# A hair under the judge's 0.005: it computes in single precision.
COST_BELOW = 0.00499
LEARNING_RATE = 0.2  # its README's; see README.md here for what else was tried
MAX_STARTS = 10
SEED = 7
LOOKS = [  # joint, axis of the world, sign, weight: see scenarios/paper_combined.toml
    ("left_wrist", 1, 1.0, 0.1 / 3),
    ("left_index3_look", 2, 1.0, 0.1 / 3),
    ("left_shoulder", 2, -1.0, 0.0002 / 3),
]


@register_pytree_node_class
class PaperDistance(ObjectiveFunction):
    """The paper's distance (equation 16, not squared), as a custom objective: jax-ik 0.4 ships a mean of squares."""

    LAST_FRAME_ONLY = True

    def __init__(self, bone_name: str, target_point: list[float]) -> None:
        self.bone_name = bone_name
        self.target_point = np.asarray(target_point, np.float32)

    def referenced_bones(self) -> tuple[str, ...]:
        """The only bone whose frame is read."""
        return (self.bone_name,)

    def __call__(self, angles: jnp.ndarray, fk_solver: object) -> jnp.ndarray:
        """Metres from the bone's head to the target."""
        frames = fk_solver.compute_fk_from_angles(angles if angles.ndim == 1 else angles[-1])
        head, _ = fk_solver.get_bone_head_tail_from_fk(frames, self.bone_name)
        offset = head - self.target_point
        return jnp.sqrt(jnp.dot(offset, offset) + 1e-12)


def looks() -> list[ObjectiveFunction]:
    """Its look objective, three times: towards the bone's tip plus one metre along an axis of the world."""
    return [BoneRelativeLookObj(bone, False, [(axis, sign)], weight) for bone, axis, sign, weight in LOOKS]


def systems(job: Job) -> list[System]:
    """Its own distance, the paper's distance, and the latter from several starts."""
    degrees = [(math.degrees(low), math.degrees(high)) for low, high in zip(job.lower, job.upper)]
    lower, upper = np.float32(job.lower), np.float32(job.upper)
    at_rest = np.zeros(len(degrees), np.float32)
    combined = job.task == "combined"

    def make(
        name: str,
        objectives: Callable[[list[float]], list[ObjectiveFunction]],
        threshold: float,
        num_steps: int,
        patience: int,
        max_starts: int,
    ) -> System:
        solver = InverseKinematicsSolver(
            job.rig,
            controlled_bones=job.joints,
            bounds=degrees,
            threshold=threshold,
            num_steps=num_steps,
            compute_sdf=False,
        )

        def solve(target: list[float]) -> tuple[Values, bool]:
            random = np.random.default_rng(SEED)
            best: tuple[float, Values] = (math.inf, at_rest)
            for start in range(max_starts):
                angles, cost, _ = solver.solve(
                    initial_rotations=at_rest if start == 0 else random.uniform(lower, upper),
                    learning_rate=LEARNING_RATE,
                    mandatory_objective_functions=objectives(target),
                    patience=patience,
                    verbose=False,
                )
                best = min(best, (cost, angles[-1]), key=lambda entry: entry[0])
                if cost <= threshold:
                    break
            return best[1], best[0] <= threshold

        several_starts = f"our loop of up to {max_starts} starts (rest, then random)"
        starts = several_starts if max_starts > 1 else "one start, at rest"
        settings = (
            f"learning_rate {LEARNING_RATE}, num_steps {num_steps}, patience {patience}, threshold {threshold:g}, "
            f"compute_sdf off, {starts}"
        )
        return System(name, settings, solve)

    def shipped(target: list[float]) -> list[ObjectiveFunction]:
        return [DistanceObjTraj(job.tip, np.array([target]), use_head=True)]

    def paper(target: list[float]) -> list[ObjectiveFunction]:
        return [PaperDistance(job.tip, target), *(looks() if combined else [])]

    steps, patience = (1000, 200) if combined else (500, 50)
    one = make("jax-ik, the paper's distance", paper, COST_BELOW, steps, patience, 1)
    several_name = f"jax-ik, the paper's distance, ≤ {MAX_STARTS} starts"
    several = make(several_name, paper, COST_BELOW, steps, patience, MAX_STARTS)
    if combined:
        return [one, several]
    # Its mean of squares is below this where the distance is below the bar. With a patience of 50 it loses a tenth.
    return [make("jax-ik, as shipped", shipped, COST_BELOW**2 / 3, 500, 200, 1), one, several]


if __name__ == "__main__":
    main("jax-ik", systems)
