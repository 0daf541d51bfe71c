"""OptIK on the Panda: SLSQP with random restarts, in Rust, called through its Python package."""

from __future__ import annotations

from optik import Robot, SolverConfig

from protocol import Job, System, Values, main

# Its objective is the squared length of the six-vector of the pose's error, so this is 1e-5 for both parts together.
TOLERANCE_SQUARED = 1e-10
MAX_SECS = 0.5


def systems(job: Job) -> list[System]:
    """One line: mode `speed`, one thread, restarts until it arrives."""
    robot = Robot.from_urdf_file(job.rig, job.base, job.tip)
    robot.set_parallelism(1)
    if robot.num_positions() != len(job.joints):
        raise ValueError(f"found {robot.num_positions()} joints in the chain, expected {len(job.joints)}")
    config = SolverConfig(solution_mode="speed", max_time=MAX_SECS, tol_f=TOLERANCE_SQUARED)
    start = job.middle()

    def solve(target: list[list[float]]) -> tuple[Values, bool]:
        solution = robot.ik(config, target, start)
        return (start, False) if solution is None else (solution[0], True)

    return [
        System(
            "optik-py",
            f"mode speed, 1 thread, tol_f {TOLERANCE_SQUARED:g}, max_time {MAX_SECS} s, its own restarts without limit",
            solve,
        )
    ]


if __name__ == "__main__":
    main("optik-py", systems)
