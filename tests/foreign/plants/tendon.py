"""The tendon platform of rigs/tendon.toml as MuJoCo has it: eight rigid links on universal joints instead of three arcs,
and tendons that run straight from hole to hole. They rub in their holes by a part of their tension, and have slack.

The rig's numbers stand here once more on purpose: nothing is shared with what is judged.
"""

import math

import mujoco

from .serve import draws, serve

LINKS, LENGTH, RADIUS, DENSITY = 8, 0.100, 0.012, 1080.0
BENDING = 0.293 * LENGTH / 3.0  # N m^2
LOSS = 0.0019 * LENGTH / 3.0    # N m^2 s
TIP_MASS, HOLE, PULLEY = 0.020, 0.010, 0.008
PULL, TENDON_LOSS, PRETENSION = 5000.0, 2.0, 6.0
RUB, SLACK = 0.05, 0.0003
STEP = 2e-4
# Angle of a tendon's holes, the input that moves it, and the sign by which a turn takes it in.
TENDONS = {"east": (0.0, 0, 1.0), "west": (math.pi, 0, -1.0), "north": (math.pi / 2, 1, 1.0), "south": (-math.pi / 2, 1, -1.0)}


def model(drawn):
    """The chain, and of each tendon its rub, pretension and slack."""
    h = LENGTH / LINKS
    stiffness, loss, tip = drawn(BENDING) / h, drawn(LOSS) / h, drawn(TIP_MASS)
    per_link = DENSITY * math.pi * RADIUS**2 * h
    around, along = per_link * (3 * RADIUS**2 + h**2) / 12, per_link * RADIUS**2 / 2

    def holes(link, z):
        return "".join('<site name="%s%d" pos="%r %r %r"/>' % (name, link, HOLE * math.cos(a), HOLE * math.sin(a), z)
                       for name, (a, _, _) in TENDONS.items())

    # Half a link stands on the ground, half of one ends at the tip: a joint in the middle of each length h.
    chain, close = holes(0, 0.0), ""
    for link in range(1, LINKS + 1):
        last = link == LINKS
        chain += '<body pos="0 0 %r">' % (h / 2 if link == 1 else h)
        for axis in ("1 0 0", "0 1 0"):
            chain += '<joint type="hinge" axis="%s" stiffness="%r" damping="%r"/>' % (axis, stiffness, loss)
        chain += '<inertial pos="0 0 %r" mass="%r" diaginertia="%r %r %r"/>' % (h / 4 if last else h / 2, per_link, around, around, along)
        chain += holes(link, h / 2)
        close += "</body>"
    chain += '<site name="tip" pos="0 0 %r"/><body pos="0 0 %r"><inertial pos="0 0 0" mass="%r" diaginertia="1e-6 1e-6 1e-6"/></body>' % (h / 2, h / 2, tip)
    tendons, own = "", []
    for name in TENDONS:
        path = "".join('<site site="%s%d"/>' % (name, link) for link in range(LINKS + 1))
        tendons += '<spatial name="%s" stiffness="%r" damping="%r" frictionloss="1" solreffriction="0.001 1" solimpfriction="0.99 0.999 0.001">%s</spatial>' % (
            name, drawn(PULL), TENDON_LOSS, path)
        own.append((drawn(RUB), drawn(PRETENSION), drawn(SLACK)))
    text = ('<mujoco><compiler angle="radian" boundmass="0" boundinertia="0"/><option timestep="%r" integrator="implicitfast" gravity="0 0 0">'
            '<flag contact="disable"/></option><worldbody>%s%s</worldbody><tendon>%s</tendon></mujoco>') % (STEP, chain, close, tendons)
    return mujoco.MjModel.from_xml_string(text), own


def main():
    plant, own = model(draws())
    data = mujoco.MjData(plant)
    mujoco.mj_forward(plant, data)
    straight, tip = data.ten_length.copy(), plant.site("tip").id

    def wind(inputs):
        for i, (_, which, sign) in enumerate(TENDONS.values()):
            _, pretension, slack = own[i]
            # Below the first number it would push: never.
            plant.tendon_lengthspring[i] = 0.0, straight[i] - pretension / plant.tendon_stiffness[i] + slack - sign * PULLEY * inputs[which]

    def advance(seconds, inputs):
        wind(inputs)
        # The last sub-step ends where the period does.
        steps = max(1, math.ceil(seconds / STEP - 1e-9))
        plant.opt.timestep = seconds / steps
        for _ in range(steps):
            for i, (rub, _, _) in enumerate(own):
                tension = plant.tendon_stiffness[i] * (data.ten_length[i] - plant.tendon_lengthspring[i][1])
                plant.tendon_frictionloss[i] = rub * max(0.0, tension)
            mujoco.mj_step(plant, data)
        mujoco.mj_kinematics(plant, data)

    wind([0.0, 0.0])
    serve(["u_x_rad", "u_y_rad"], ["x_m", "y_m", "z_m"], lambda: data.site_xpos[tip], advance)


if __name__ == "__main__":
    main()
