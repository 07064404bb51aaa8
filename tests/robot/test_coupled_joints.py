"""Joints that follow others: one column of the Jacobian for all axes that a joint moves."""

import mujoco
import numpy as np
import pytest

from vergence.errors import InputError
from vergence.geometry import se3_inverse, se3_log
from vergence.robot import Arm, chain_state, manipulability, world_jacobian

STEP = 1e-6
# An axis that leads, one beyond it and one before it that follow, and one that follows a follower.
EQUALITIES = """
<equality>
  <joint joint1="j2" joint2="j1" polycoef="0.2 -1 0 0 0"/>
  <joint joint1="j0" joint2="j1" polycoef="-0.1 0.3 0 0 0"/>
  <joint joint1="j5" joint2="j2" polycoef="0.4 0.5 0 0 0"/>
</equality>"""


def coupled_model(rng: np.random.Generator, count: int, equalities: str = EQUALITIES, kind="hinge"):
    """A serial arm of so many axes with a camera at its end."""
    head = ""
    for i in range(count):
        x, y, z = rng.uniform(-0.3, 0.3, 3)
        a, b, c = rng.normal(size=3)
        reference = rng.uniform(-0.2, 0.2)
        head += (
            f'<body name="b{i}" pos="{x} {y} {z}"><geom size="0.02"/><joint name="j{i}" '
            f'type="{kind if i == 2 else "hinge"}" axis="{a} {b} {c}" ref="{reference}" '
            f'range="-2 2"/>'
        )
    return mujoco.MjModel.from_xml_string(
        '<mujoco><compiler angle="radian" autolimits="true"/><worldbody>'
        f'{head}<camera name="eye" pos="0.1 0 0.2" euler="0.3 0.2 0.1"/>{"</body>" * count}'
        f"</worldbody>{equalities}</mujoco>"
    )


def coupled_arm(seed: int, count: int, kind: str = "hinge") -> Arm:
    return Arm.from_mujoco(
        coupled_model(np.random.default_rng([70, seed]), count, kind=kind), "eye"
    )


@pytest.mark.parametrize("kind", ["hinge", "slide"])
def test_followers_move_as_the_models_equalities_say(kind: str) -> None:
    model = coupled_model(np.random.default_rng(71), 8, kind=kind)
    arm = Arm.from_mujoco(model, "eye")
    assert arm.names == ("j1", "j3", "j4", "j6", "j7")
    assert arm.axis_names == tuple(f"j{i}" for i in range(8))
    rest = {f"j{i}": model.qpos0[i] for i in range(8)}
    for q in np.random.default_rng(72).uniform(-0.8, 0.8, (5, 5)):
        at = dict(zip(arm.names, q, strict=True))
        at["j2"] = rest["j2"] + 0.2 - (at["j1"] - rest["j1"])
        at["j0"] = rest["j0"] - 0.1 + 0.3 * (at["j1"] - rest["j1"])
        at["j5"] = rest["j5"] + 0.4 + 0.5 * (at["j2"] - rest["j2"])
        data = mujoco.MjData(model)
        for name, value in at.items():
            data.joint(name).qpos[0] = value
        mujoco.mj_forward(model, data)
        equal = data.efc_type == int(mujoco.mjtConstraint.mjCNSTR_EQUALITY)
        np.testing.assert_allclose(data.efc_pos[equal], 0.0, atol=1e-12)
        T = arm.forward_kinematics(q)
        np.testing.assert_allclose(T[:3, 3], data.cam("eye").xpos, atol=1e-12)


@pytest.mark.parametrize(
    ("count", "kind"), [(6, "hinge"), (9, "hinge"), (9, "slide"), (11, "slide")]
)
def test_a_coupled_jacobian_is_the_difference_of_poses(count: int, kind: str) -> None:
    arm = coupled_arm(count, count, kind)
    n = arm.joint_count
    assert n == count - 3
    q = np.random.default_rng([73, count]).uniform(-0.8, 0.8, n)
    J = arm.jacobian(q)
    for i in range(n):
        dq = STEP * np.eye(n)[i]
        ahead, behind = arm.forward_kinematics(q + dq), arm.forward_kinematics(q - dq)
        twist = se3_log(se3_inverse(behind) @ ahead) / (2 * STEP)
        np.testing.assert_allclose(J[:, i], twist, atol=1e-8)
    state = chain_state(arm.chain, q)
    turned = np.kron(np.eye(2), state.R.T) @ world_jacobian(arm.chain, state, n)
    np.testing.assert_allclose(J, turned, atol=1e-13)


@pytest.mark.parametrize("per_joint", [False, True])
@pytest.mark.parametrize("count", [7, 9, 11])
def test_a_coupled_manipulability_gradient_is_the_difference_of_the_measure(
    count: int, per_joint: bool
) -> None:
    arm = coupled_arm(count, count)
    q = np.random.default_rng([74, count]).uniform(-0.5, 0.5, arm.joint_count)

    def measure(q: np.ndarray):
        return manipulability(arm.chain, q, arm.q_min, arm.q_max, 50.0, per_joint, 0.0)

    here = measure(q)
    differences = np.array(
        [
            (measure(q + dq).value - measure(q - dq).value) / (2 * STEP)
            for dq in STEP * np.eye(arm.joint_count)
        ]
    )
    scale = np.abs(here.gradient_q).max()
    assert scale > 0
    np.testing.assert_allclose(here.gradient_q / scale, differences / scale, atol=1e-5)


def test_a_leader_goes_as_far_as_the_first_of_its_axes_may() -> None:
    arm = coupled_arm(2, 9)
    moved = arm.chain.coupling[arm.chain.coupling[:, 0] == 0]
    assert len(moved) == 4
    for end in (arm.q_min[0], arm.q_max[0]):
        assert np.abs(moved[:, 1] * end + moved[:, 2]).max() == pytest.approx(2.0)


@pytest.mark.parametrize(
    ("equality", "complaint"),
    [
        ('<joint joint1="j2" joint2="j1" polycoef="0 1 0.5 0 0"/>', "no higher powers"),
        ('<joint joint1="j2" joint2="j1" polycoef="0 0 0 0 0"/>', "ratio other than zero"),
        ('<joint joint1="j2" polycoef="0 0 0 0 0"/>', "follows no joint"),
        ('<joint joint1="j2" joint2="side" polycoef="0 1 0 0 0"/>', "follows side"),
        (
            '<joint joint1="j2" joint2="j1"/><joint joint1="j2" joint2="j0"/>',
            "follows two joints",
        ),
        ('<joint joint1="j2" joint2="j1"/><joint joint1="j1" joint2="j2"/>', "follows itself"),
        ('<connect body1="b3" body2="b0" anchor="0 0 0"/>', "connect constraint.*closes a loop"),
        ('<weld body1="b3"/>', "weld constraint.*closes a loop"),
        (
            '<joint joint1="j2" joint2="j1" polycoef="9 1 0 0 0"/>',
            "j1, which it follows, no range",
        ),
    ],
)
def test_a_coupling_that_no_chain_can_have_is_refused_with_the_joint(equality, complaint) -> None:
    model = mujoco.MjSpec.from_string(
        '<mujoco><compiler autolimits="true" angle="radian"/><worldbody><body name="b0">'
        '<joint name="j0"/><geom size="0.1"/><body name="b1"><joint name="j1" range="-1 1"/>'
        '<geom size="0.1"/><body name="b2"><joint name="j2" range="-1 1"/><geom size="0.1"/>'
        '<body name="b3" pos="1 0 0"><joint name="j3"/><geom size="0.1"/></body></body></body>'
        '<body><joint name="side"/><geom size="0.1"/></body></body></worldbody>'
        f"<equality>{equality}</equality></mujoco>"
    ).compile()
    with pytest.raises(InputError, match=complaint) as caught:
        Arm.from_mujoco(model, "b3", kind="body")
    assert caught.value.key.startswith("joint j")


def test_a_constraint_beyond_the_arm_or_switched_off_is_nobodys_business() -> None:
    model = mujoco.MjModel.from_xml_string(
        '<mujoco><worldbody><body name="b0"><joint name="j0"/><geom size="0.1"/><body name="b1">'
        '<joint name="j1"/><geom size="0.1"/><body name="f1"><joint name="f1"/><geom size="0.1"/>'
        '</body><body name="f2"><joint name="f2"/><geom size="0.1"/></body></body></body>'
        '</worldbody><equality><joint joint1="f1" joint2="f2"/>'
        '<connect body1="f1" body2="f2" anchor="0 0 0"/>'
        '<joint joint1="j1" joint2="j0" active="false"/></equality></mujoco>'
    )
    assert Arm.from_mujoco(model, "b1", kind="body").names == ("j0", "j1")


def test_the_models_rate_limits_hold_for_followers_too() -> None:
    model = mujoco.MjModel.from_xml_string(
        '<mujoco><custom><numeric name="a/velocity_limit" data="1"/>'
        '<numeric name="b/velocity_limit" data="1"/></custom><worldbody><body><joint name="a"/>'
        '<geom size="0.1"/><body><joint name="b"/><geom size="0.1"/><body name="tip">'
        '<joint name="c" type="slide"/><geom size="0.1"/></body></body></body></worldbody>'
        '<equality><joint joint1="b" joint2="a" polycoef="0 -4 0 0 0"/></equality></mujoco>'
    )
    arm = Arm.from_mujoco(model, "tip", kind="body")
    np.testing.assert_allclose(arm.rate_max, [0.25, 0.5])
    np.testing.assert_allclose(arm.acceleration_max, [4 * np.pi, 2.0])
    tighter = Arm.from_mujoco(model, "tip", rate_max=np.array([0.2, 9.0]), kind="body")
    np.testing.assert_allclose(tighter.rate_max, [0.2, 9.0])
    with pytest.raises(InputError, match=r"rate_max of a: given 0.3; allowed: up to 0.25"):
        Arm.from_mujoco(model, "tip", rate_max=0.3, kind="body")
