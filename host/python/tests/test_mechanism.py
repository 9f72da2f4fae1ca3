"""Mechanisms of other programs as rigs."""

import numpy as np
import pytest

import sinew_ident

ARM = """<mujoco model="arm">
  <option timestep="0.001" integrator="RK4"/>
  <worldbody>
    <body name="link" pos="0 0 1">
      <joint name="shoulder" type="hinge" axis="0 1 0" damping="0.02"/>
      <geom type="capsule" fromto="0 0 0 0 0 -0.3" size="0.01" mass="0.2"/>
    </body>
  </worldbody>
  <actuator><motor name="drive" joint="shoulder" gear="1"/></actuator>
  <sensor><jointpos name="angle" joint="shoulder"/></sensor>
</mujoco>
"""


def test_a_rig_of_a_mujoco_model_moves_as_mujoco_does(tmp_path):
    mujoco = pytest.importorskip("mujoco")
    path = tmp_path / "arm.xml"
    path.write_text(ARM)
    rig = sinew_ident.Rig.from_mjcf(path)
    (drive,) = rig.inputs
    (angle,) = rig.sensors
    model = mujoco.MjModel.from_xml_string(ARM)
    data = mujoco.MjData(model)
    t = 0.01 * np.arange(300)
    u = 0.3 * np.sin(4 * t)
    q = []
    for value in u:
        q.append(data.qpos[0])
        data.ctrl[0] = value
        mujoco.mj_step(model, data, 10)
    out = sinew_ident.simulate(rig, {"t": t, drive.column: u, angle.column: np.array(q)})
    assert np.ptp(q) > 0.5
    np.testing.assert_allclose(out[angle.column], q, atol=1e-4)


def test_a_mechanism_tells_what_it_left_out_and_what_it_added(tmp_path):
    path = tmp_path / "arm.xml"
    path.write_text(ARM.replace("<sensor><jointpos name=\"angle\" joint=\"shoulder\"/></sensor>", "")
                    .replace('damping="0.02"', 'damping="0.02" range="-1 1" limited="true"'))
    rig = sinew_ident.Rig.from_mjcf(path)
    assert any("range" in line for line in rig.left_out), rig.left_out
    assert any("sensor" in line for line in rig.added), rig.added


def test_joints_that_are_not_there_are_refused_by_name(tmp_path):
    path = tmp_path / "arm.xml"
    path.write_text(ARM)
    with pytest.raises(ValueError, match="elbow"):
        sinew_ident.Rig.from_mjcf(path, joints="elbow")
    with pytest.raises(ValueError, match="arm.xml"):
        sinew_ident.Rig.from_urdf(path)


def test_a_urdf_joint_is_a_rig(tmp_path):
    path = tmp_path / "arm.urdf"
    path.write_text("""<robot name="arm">
  <link name="base"/>
  <link name="link"><inertial><origin xyz="0 0 -0.15"/><mass value="0.2"/>
    <inertia ixx="0.0015" iyy="0.0015" izz="1e-5" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="shoulder" type="revolute"><parent link="base"/><child link="link"/>
    <axis xyz="0 1 0"/><limit lower="-2" upper="2" effort="3" velocity="10"/>
    <dynamics damping="0.02" friction="0.0"/></joint>
</robot>""")
    rig = sinew_ident.Rig.from_urdf(path)
    inertia = rig.parameters["link.inertia" if "link.inertia" in rig.parameters else "shoulder.inertia"]
    assert inertia.value == pytest.approx(0.0015 + 0.2 * 0.15**2, rel=1e-6)
