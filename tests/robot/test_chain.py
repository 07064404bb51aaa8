"""A chain read off a model moves as the model does, whatever the arm."""

import pickle
from dataclasses import replace

import mujoco
import numpy as np
import pytest
from random_arms import random_arm

from vergence.errors import InputError, ShapeError
from vergence.geometry import se3_inverse, se3_log
from vergence.robot import Arm, chain_state, forward_kinematics, jacobian, world_jacobian

FROM_MUJOCO_CAMERA = np.diag([1.0, -1.0, -1.0])
TIPS = {"camera": "eye", "site": "tool", "body": "last"}


def placed(model: mujoco.MjModel, arm: Arm, q: np.ndarray, rng: np.random.Generator):
    """The model with the arm at q and every other joint somewhere."""
    data = mujoco.MjData(model)
    data.qpos[:] = rng.uniform(-1, 1, model.nq)
    for name, value in zip(arm.names, q, strict=True):
        data.qpos[model.joint(name).qposadr[0]] = value
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    mujoco.mj_camlight(model, data)
    return data


def pose_in(data, kind: str) -> tuple[np.ndarray, np.ndarray]:
    if kind == "camera":
        return data.cam("eye").xmat.reshape(3, 3) @ FROM_MUJOCO_CAMERA, data.cam("eye").xpos
    if kind == "site":
        return data.site("tool").xmat.reshape(3, 3), data.site("tool").xpos
    return data.body("last").xmat.reshape(3, 3), data.body("last").xpos


@pytest.mark.parametrize("kind", TIPS)
@pytest.mark.parametrize("joint_count", [1, 5, 6, 7, 9])
def test_pose_and_jacobian_are_those_of_mujoco(joint_count: int, kind: str) -> None:
    rng = np.random.default_rng([5, joint_count])
    for _ in range(4):
        model = mujoco.MjModel.from_xml_string(random_arm(rng, joint_count))
        arm = Arm.from_mujoco(model, TIPS[kind], kind=kind)
        assert arm.names == tuple(f"j{i}" for i in range(joint_count))
        q = rng.uniform(-2, 2, joint_count)
        data = placed(model, arm, q, rng)
        R, p = pose_in(data, kind)
        T = arm.forward_kinematics(q)
        np.testing.assert_allclose(T[:3, :3], R, atol=1e-12)
        np.testing.assert_allclose(T[:3, 3], p, atol=1e-12)
        theirs = np.zeros((6, model.nv))
        body = model.body("last").id
        mujoco.mj_jac(model, data, theirs[:3], theirs[3:], p, body)
        columns = [model.joint(name).dofadr[0] for name in arm.names]
        turned = np.kron(np.eye(2), R.T) @ theirs[:, columns]
        np.testing.assert_allclose(arm.jacobian(q), turned, atol=1e-12)


def test_an_arm_is_of_one_kind_for_kernels_wherever_it_comes_from() -> None:
    rng = np.random.default_rng(0)
    read = Arm.from_mujoco(mujoco.MjModel.from_xml_string(random_arm(rng, 6)), "eye")
    written = read.chain._replace(rotation=read.chain.rotation.copy())
    for arm in (read, replace(read, chain=written), pickle.loads(pickle.dumps(read))):
        arrays = (*arm.chain, arm.q_min, arm.q_max, arm.rate_max, arm.acceleration_max)
        assert not any(array.flags.writeable for array in arrays)
        assert all(array.flags.c_contiguous for array in arrays)
        np.testing.assert_array_equal(arm.jacobian(np.ones(6)), read.jacobian(np.ones(6)))


@pytest.mark.parametrize("joint_count", [1, 6, 7])
def test_the_jacobian_is_the_twist_of_the_tip_in_its_own_frame(joint_count: int) -> None:
    rng = np.random.default_rng([6, joint_count])
    arm = Arm.from_mujoco(mujoco.MjModel.from_xml_string(random_arm(rng, joint_count)), "eye")
    q, step = rng.uniform(-1, 1, joint_count), 1e-6
    J = arm.jacobian(q)
    for i in range(joint_count):
        dq = np.zeros(joint_count)
        dq[i] = step
        ahead, behind = arm.forward_kinematics(q + dq), arm.forward_kinematics(q - dq)
        twist = se3_log(se3_inverse(behind) @ ahead) / (2 * step)
        np.testing.assert_allclose(J[:, i], twist, atol=1e-8)


def test_the_walk_from_the_tip_and_the_walk_from_the_base_agree() -> None:
    rng = np.random.default_rng(7)
    arm = Arm.from_mujoco(mujoco.MjModel.from_xml_string(random_arm(rng, 7)), "eye")
    q = rng.uniform(-1, 1, 7)
    state = chain_state(arm.chain, q)
    turned = np.kron(np.eye(2), state.R.T) @ world_jacobian(arm.chain, state, 7)
    np.testing.assert_allclose(jacobian(arm.chain, q), turned, atol=1e-13)
    T = forward_kinematics(arm.chain, q)
    np.testing.assert_array_equal(T[:3, :3], state.R)
    np.testing.assert_array_equal(T[:3, 3], state.p)


def test_limits_are_the_models_and_infinite_where_it_has_none() -> None:
    model = mujoco.MjModel.from_xml_string(random_arm(np.random.default_rng(8), 9))
    arm = Arm.from_mujoco(model, "eye")
    for name, low, high in zip(arm.names, arm.q_min, arm.q_max, strict=True):
        if model.joint(name).limited[0]:
            assert (low, high) == tuple(model.joint(name).range)
        else:
            assert (low, high) == (-np.inf, np.inf)
    assert np.isfinite(arm.q_min).any()
    assert np.isinf(arm.q_min).any()


def test_normalized_positions_reach_one_at_the_limits() -> None:
    chain = Arm.from_mujoco(
        mujoco.MjModel.from_xml_string(random_arm(np.random.default_rng(9), 3)), "eye"
    ).chain
    arm = Arm(
        ("a", "b", "c"), chain, [-1.0, 2.0, -np.inf], [3.0, 4.0, np.inf], np.ones(3), np.ones(3)
    )
    np.testing.assert_allclose(
        arm.normalized(np.array([[-1.0, 2.0, 5.0], [3.0, 4.0, -5.0], [1.0, 3.0, 0.0]])),
        [[-1, -1, 0], [1, 1, 0], [0, 0, 0]],
    )
    assert arm.outside(np.array([3.0, 2.5, 1e9])).tolist() == [True, False, False]


def test_a_wrong_tip_is_answered_with_the_right_ones() -> None:
    model = mujoco.MjModel.from_xml_string(random_arm(np.random.default_rng(10), 3))
    with pytest.raises(InputError, match="did you mean eye") as caught:
        Arm.from_mujoco(model, "eyes")
    assert (caught.value.key, caught.value.given) == ("camera", "eyes")
    with pytest.raises(InputError, match="camera, site, body"):
        Arm.from_mujoco(model, "eye", kind="lens")


def test_a_tip_that_nothing_moves_is_refused() -> None:
    model = mujoco.MjModel.from_xml_string(
        '<mujoco><worldbody><camera name="wall"/><body name="ball"><joint type="ball"/>'
        '<geom size="0.1"/><camera name="rolling"/></body></worldbody></mujoco>'
    )
    with pytest.raises(InputError, match="hinge or slide joint carries"):
        Arm.from_mujoco(model, "wall")
    with pytest.raises(InputError, match="ball or free"):
        Arm.from_mujoco(model, "rolling")


def test_limits_the_wrong_way_round_are_refused_with_the_joint() -> None:
    chain = Arm.from_mujoco(
        mujoco.MjModel.from_xml_string(random_arm(np.random.default_rng(11), 2)), "eye"
    ).chain
    one = np.ones(2)
    with pytest.raises(InputError, match="elbow") as caught:
        Arm(("base", "elbow"), chain, [-1.0, 1.0], [1.0, -1.0], one, one)
    assert caught.value.allowed == "lower below upper"
    with pytest.raises(InputError, match="rate_max"):
        Arm(("base", "elbow"), chain, -one, one, 0 * one, one)
    with pytest.raises(ShapeError, match="q_min"):
        Arm(("base", "elbow"), chain, np.ones(3), one, one, one)


def test_a_range_the_wrong_way_round_is_no_joint_without_limits() -> None:
    model = mujoco.MjModel.from_xml_string(
        '<mujoco><compiler autolimits="true"/><worldbody><body><joint name="elbow" range="90 -90"/>'
        '<geom size="0.1"/><camera name="eye"/></body></worldbody></mujoco>'
    )
    with pytest.raises(InputError, match="elbow") as caught:
        Arm.from_mujoco(model, "eye")
    assert caught.value.allowed == "lower below upper"


def test_as_many_rate_limits_as_joints() -> None:
    model = mujoco.MjModel.from_xml_string(random_arm(np.random.default_rng(35), 4))
    arm = Arm.from_mujoco(model, "eye", rate_max=2.0, acceleration_max=np.arange(1.0, 5.0))
    np.testing.assert_array_equal(arm.rate_max, 2.0)
    np.testing.assert_array_equal(arm.acceleration_max, [1.0, 2.0, 3.0, 4.0])
    with pytest.raises(InputError, match="one value, or 4"):
        Arm.from_mujoco(model, "eye", rate_max=np.ones(3))


def test_a_wrong_number_of_joints_is_refused() -> None:
    arm = Arm.from_mujoco(
        mujoco.MjModel.from_xml_string(random_arm(np.random.default_rng(12), 4)), "eye"
    )
    with pytest.raises(ShapeError, match="q has shape"):
        arm.forward_kinematics(np.zeros(3))
    with pytest.raises(ShapeError, match="q has shape"):
        arm.jacobian(np.zeros(5))
    assert arm.index("j2") == 2
    with pytest.raises(InputError, match="did you mean"):
        arm.index("j22")
