"""The mass of rigs/mass-spring-damper.toml as MuJoCo has it, with dry friction at its joint.

MuJoCo's friction creeps below its level, by little with the numbers below; the middle plant is that of
rigs/experiments/mass-spring-damper.left-out.toml.
"""

import math

import mujoco

from .serve import draws, serve

MASS, STIFFNESS, DAMPING, LEVEL, GAIN = 1.0, 40.0, 1.2, 1.0, 1.0
STEP = 1e-4


def model(drawn):
    text = ('<mujoco><compiler boundmass="0" boundinertia="0"/><option timestep="%r" integrator="implicitfast" gravity="0 0 0"/><worldbody><body>'
            '<joint name="mass" type="slide" axis="1 0 0" stiffness="%r" damping="%r" frictionloss="%r" solreffriction="%r 1" solimpfriction="0.999 0.9999 0.001"/>'
            '<inertial pos="0 0 0" mass="%r" diaginertia="1 1 1"/></body></worldbody><actuator><motor joint="mass" gear="%r"/></actuator></mujoco>')
    return mujoco.MjModel.from_xml_string(
        text % (STEP, drawn(STIFFNESS), drawn(DAMPING), drawn(LEVEL), 2 * STEP, drawn(MASS), GAIN))


def main():
    plant = model(draws())
    data = mujoco.MjData(plant)

    def advance(seconds, inputs):
        # The last sub-step ends where the period does.
        steps = max(1, math.ceil(seconds / STEP - 1e-9))
        plant.opt.timestep = seconds / steps
        data.ctrl[:] = inputs
        mujoco.mj_step(plant, data, steps)

    serve(["u_N"], ["q_m"], lambda: [data.qpos[0]], advance)


if __name__ == "__main__":
    main()
