"""mink on the Panda: differential inverse kinematics by quadratic programs over MuJoCo, in our loop of steps."""

from __future__ import annotations

import xml.etree.ElementTree as ET

import mink
import mujoco
import numpy as np

from protocol import Job, System, Values, main
from restarts import SETTINGS, solve_with_restarts

# Best of those tried (lm_damping 0 to 1, damping 1e-12 to 1e-4, velocity limit none, 0.5 and 1).
LM_DAMPING = 0.1
QP_SOLVER = "daqp"


def chain_of(job: Job) -> mujoco.MjModel:
    """Compiles the arm alone: geometry, massless inertias and all that lies beyond the tip are taken out."""
    robot = ET.parse(job.rig).getroot()
    joints = [joint for joint in robot.findall("joint") if joint.find("child") is not None]
    parent_joints = {joint.find("child").get("link"): joint for joint in joints}
    links = {job.tip}
    link = job.tip
    while link != job.base:
        link = parent_joints[link].find("parent").get("link")
        links.add(link)
    for element in list(robot):
        if element.tag == "link" and element.get("name") in links:
            for part in list(element):
                mass = part.find("mass")
                if part.tag in ("visual", "collision") or (mass is not None and float(mass.get("value")) == 0.0):
                    element.remove(part)
        elif element.tag != "joint" or element.find("child").get("link") not in links - {job.base}:
            robot.remove(element)
    ET.SubElement(ET.SubElement(robot, "mujoco"), "compiler", fusestatic="false")
    model = mujoco.MjModel.from_xml_string(ET.tostring(robot, encoding="unicode"))
    names = [mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_JOINT, joint_idx) for joint_idx in range(model.njnt)]
    if names != job.joints:
        raise ValueError(f"found the joints {names}, expected {job.joints}")
    return model


def systems(job: Job) -> list[System]:
    """One line: a frame task with Levenberg–Marquardt damping and the default configuration limit."""
    model = chain_of(job)
    configuration = mink.Configuration(model)
    limits = [mink.ConfigurationLimit(model)]
    task = mink.FrameTask(job.tip, "body", position_cost=1.0, orientation_cost=1.0, lm_damping=LM_DAMPING)

    def begin(values: np.ndarray) -> mink.Configuration:
        configuration.update(values)
        return configuration

    def step(state: mink.Configuration) -> mink.Configuration | None:
        try:
            velocity = mink.solve_ik(state, [task], 1.0, QP_SOLVER, limits=limits)
        except mink.NoSolutionFound:
            return None
        state.integrate_inplace(velocity, 1.0)
        return state

    def solve(target: list[list[float]]) -> tuple[Values, bool]:
        task.set_target(mink.SE3.from_matrix(np.array(target)))
        return solve_with_restarts(
            job, begin, lambda state: task.compute_error(state), step, lambda state: state.q.copy()
        )

    return [System("mink", f"{QP_SOLVER}, lm_damping {LM_DAMPING}; {SETTINGS}", solve)]


if __name__ == "__main__":
    main("mink", systems)
