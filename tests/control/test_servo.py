"""The servo: fast ways equal the general one, stacks add up, and a user's own parts take part."""

from dataclasses import replace

import numpy as np
import pytest
from servo_scene import CAMERA, SQUARE, START, in_view, observed, puma, seen

from vergence.control import (
    AXES,
    CameraMounting,
    CameraVelocity,
    DampedPseudoInverse,
    ImageBased,
    Limits,
    MotionSettings,
    OptimalTracking,
    PointPose,
    Posture,
    PseudoInverse,
    Quadratic,
    QuadraticProgram,
    Servo,
    Situation,
    Term,
    axis_mask,
)
from vergence.control.objectives import least_squares, state_of
from vergence.errors import InputError, ShapeError
from vergence.features import Centre, Feature, Lines, LogDepth, Points
from vergence.geometry import se3_exp, so3_log, transform_points
from vergence.part_answers import PartError
from vergence.parts import as_part, knob, part
from vergence.signals import JointState, Observation, OutcomeKind, Reference

ARM = puma()
WORLD = in_view(ARM, START, SQUARE)
PERIOD = 1 / 30
AT_TIP = CameraMounting(CAMERA)
GENERAL = CameraMounting(CAMERA, T_tip_camera=np.eye(4))  # the same place, by the general way


def commanded(servo: Servo, points_px: np.ndarray, desired_px: np.ndarray, q=START):
    joints = JointState(0.0, q, np.zeros(6))
    return servo.command(observed(points_px), Reference(0.0, desired_px), joints)


@pytest.mark.parametrize("feed_forward", [False, True])
@pytest.mark.parametrize("penalty", ["product", "per_joint"])
@pytest.mark.parametrize(
    "axes", [("x", "y"), ("x", "y", "rx", "ry"), ("x", "y", "z", "rx", "ry", "rz")]
)
def test_the_kernel_of_optimal_tracking_equals_the_general_servo(axes, penalty, feed_forward):
    rng = np.random.default_rng(7)
    objective = OptimalTracking(
        axes=axes, avoidance_axes=("x", "y"), S=1e-3, penalty=penalty,
        penalty_k=50.0 if penalty == "per_joint" else 1e5,
    )  # fmt: skip
    motion = MotionSettings(feed_forward, feed_forward)
    for _ in range(10):
        q = START + rng.uniform(-0.1, 0.1, 6)
        points, depth = seen(ARM, q, in_view(ARM, q, SQUARE))
        fast, general = (
            Servo(
                ARM, mounting, objective, solver=PseudoInverse(), depth_m=depth,
                situation=Situation(PERIOD, motion),
            )
            for mounting in (AT_TIP, GENERAL)
        )  # fmt: skip
        assert fast.tracking is not None
        assert general.tracking is None
        for _ in range(3):
            desired = points + rng.normal(0, 20, points.shape)
            one, other = (commanded(servo, points, desired, q) for servo in (fast, general))
            size = np.abs(one.velocity).max()
            np.testing.assert_allclose(other.velocity, one.velocity, atol=1e-12 * max(size, 1.0))
            np.testing.assert_allclose(other.v_camera, one.v_camera, atol=1e-12)


@pytest.mark.parametrize("solver", [PseudoInverse(), DampedPseudoInverse(), QuadraticProgram()])
def test_a_camera_mounted_elsewhere_moves_the_arm_as_one_at_the_tip_does(solver):
    offset = se3_exp(np.array([0.02, -0.03, 0.05, 0.1, -0.2, 0.3]))
    points, depth = seen(ARM, START, WORLD)
    desired = points + [5.0, -3.0]
    limits = Limits(manipulability_share=0.0) if solver == QuadraticProgram() else None
    rotation, position = ARM.chain.rotation.copy(), ARM.chain.position.copy()
    back = np.linalg.inv(offset)
    position[-1] += rotation[-1] @ back[:3, 3]
    rotation[-1] = rotation[-1] @ back[:3, :3]
    flange = replace(ARM, chain=ARM.chain._replace(rotation=rotation, position=position))
    at_tip = Servo(ARM, CAMERA, ImageBased(), limits=limits, solver=solver, depth_m=depth)
    mounted = Servo(
        flange, CameraMounting(CAMERA, T_tip_camera=offset), ImageBased(), limits=limits,
        solver=solver, depth_m=depth,
    )  # fmt: skip
    one, other = (commanded(servo, points, desired) for servo in (at_tip, mounted))
    np.testing.assert_allclose(other.velocity, one.velocity, atol=1e-6)
    np.testing.assert_allclose(other.v_camera, one.v_camera, atol=1e-6)


def test_two_equal_objectives_of_half_the_weight_are_one():
    points, depth = seen(ARM, START, WORLD)
    desired = points + [20.0, -10.0]
    half = Term(ImageBased(gain=2.0), 0.5)
    one = Servo(ARM, CAMERA, ImageBased(gain=2.0), depth_m=depth)
    two = Servo(ARM, CAMERA, [half, half], depth_m=depth)
    first, second = (commanded(servo, points, desired) for servo in (one, two))
    np.testing.assert_allclose(second.velocity, first.velocity, atol=1e-9)


def test_a_posture_acts_in_the_null_space_of_the_others():
    points, depth = seen(ARM, START, WORLD)
    one_axis = ImageBased(gain=1.0)
    few = points[:1]
    servo = Servo(
        ARM, CAMERA, [one_axis, Posture(gain=1.0)], solver=DampedPseudoInverse(), depth_m=depth[:1]
    )
    alone = Servo(ARM, CAMERA, one_axis, solver=DampedPseudoInverse(), depth_m=depth[:1])
    # Six joints and a full twist leave no null space: the posture changes nothing.
    first, second = (commanded(s, few, few + 3.0) for s in (alone, servo))
    np.testing.assert_allclose(second.velocity, first.velocity, atol=1e-9)
    program = Servo(
        ARM, CAMERA, [one_axis, Posture(gain=1.0, strength=1e-3)],
        limits=Limits(manipulability_share=0.0, order=()), depth_m=depth[:1],
    )  # fmt: skip
    moved = commanded(program, few, few).velocity
    middle = 0.5 * (ARM.q_min + ARM.q_max)
    assert moved @ (middle - START) > 0


def test_the_points_depths_bring_the_camera_straight_to_its_goal():
    q = START + 0.05
    points, depth = seen(ARM, q, WORLD)
    desired, desired_depth = seen(ARM, START, WORLD)
    servo = Servo(ARM, CAMERA, PointPose(gain=1.0), solver=PseudoInverse())
    joints = JointState(0.0, q, np.zeros(6))
    reference = Reference(0.0, desired, depth_m=depth, desired_depth_m=desired_depth)
    command = servo.command(observed(points), reference, joints)
    T_goal_now = np.linalg.inv(ARM.forward_kinematics(START)) @ ARM.forward_kinematics(q)
    v = T_goal_now[:3, :3] @ command.v_camera[:3]
    straight = -T_goal_now[:3, 3]
    assert v @ straight == pytest.approx(np.linalg.norm(v) * np.linalg.norm(straight), rel=1e-6)


@pytest.mark.parametrize("solver", [PseudoInverse(), DampedPseudoInverse(singular_below=1e-9)])
def test_axes_that_no_objective_controls_do_not_move(solver):
    q = START + 0.05
    (now, depth), (desired, desired_depth) = seen(ARM, q, WORLD), seen(ARM, START, WORLD)
    features = Points(CAMERA.normalize(now), depth)
    goal = Points(CAMERA.normalize(desired), desired_depth)
    twists = []
    for axes in (AXES, ("y", "rz")):
        servo = Servo(ARM, CAMERA, PointPose(gain=0.1, axes=axes), solver=solver)
        twists.append(ARM.jacobian(q) @ servo.rates(features, goal, q))
    np.testing.assert_allclose(twists[1], twists[0] * axis_mask(("y", "rz")), atol=1e-9)


def test_an_image_point_its_depth_and_the_rotation_are_the_law_2_half_d():
    """[Malis1999]: the rotation decays by itself, the point on a straight line in the image."""
    T = se3_exp(np.array([0.1, -0.05, 0.1, 0.2, -0.1, 0.4]))
    goal = np.array([[-0.1, -0.1, 0.6], [0.1, -0.1, 0.6], [0.1, 0.1, 0.65], [-0.1, 0.1, 0.7]])
    now = transform_points(T, goal)
    features = Points(now[:, :2] / now[:, 2:], now[:, 2])
    desired = Points(goal[:, :2] / goal[:, 2:], goal[:, 2])
    stack = [
        ImageBased(gain=2.0, feature=Centre, interaction="current"),
        ImageBased(gain=2.0, feature=LogDepth, interaction="current"),
        PointPose(gain=2.0, axes=("rx", "ry", "rz")),
    ]
    quadratics = [objective.quadratic(state_of(features, desired)) for objective in stack]
    assert np.linalg.matrix_rank(quadratics[2].H) == 3
    v = np.linalg.solve(sum(q.H for q in quadratics), sum(q.g for q in quadratics))
    np.testing.assert_allclose(v[3:], 2.0 * so3_log(T[:3, :3].copy()), atol=1e-5)
    for kind in (Centre, LogDepth):
        s, s_star = kind(features.points, now[:, 2]), kind(desired.points, goal[:, 2])
        np.testing.assert_allclose(s.interaction() @ v, -2.0 * s.error(s_star), atol=1e-5)


def test_joint_rates_for_points_are_asked_for_in_one_call():
    points, depth = seen(ARM, START, WORLD)
    features = Points(CAMERA.normalize(points), depth)
    desired = Points(CAMERA.normalize(points + [10.0, 0.0]), depth)
    servo = Servo(ARM, CAMERA, ImageBased(gain=2.0))
    rates = servo.rates(features, desired, q=START.tolist())
    assert rates.shape == (6,)
    twist = ImageBased(gain=2.0).twist(features, desired)
    assert (ARM.jacobian(START) @ rates)[:3] @ twist[:3] > 0
    with pytest.raises(InputError, match="depth_m"):
        Points([[0.0, 0.0]], depth_m=0.0)


@as_part("feature")
class Area(Feature):
    """Logarithm of the area of a triangle, a measure of distance."""

    def value(self):
        (x0, y0), (x1, y1), (x2, y2) = self.points
        return np.log([abs((x1 - x0) * (y2 - y0) - (x2 - x0) * (y1 - y0)) / 2])

    def interaction(self):
        L, step = Points(self.points, self.depth_m).interaction(), 1e-6
        moved = [self.points + step * (L @ e).reshape(-1, 2) for e in np.eye(6)]
        back = [self.points - step * (L @ e).reshape(-1, 2) for e in np.eye(6)]
        rows = [
            (Area(m, self.depth_m).value() - Area(b, self.depth_m).value()) / (2 * step)
            for m, b in zip(moved, back, strict=True)
        ]
        return np.array(rows).T


def test_a_feature_of_ones_own_is_stacked_with_points():
    triangle = SQUARE[:3]
    world = in_view(ARM, START, triangle)
    desired, depth = seen(ARM, START, world)
    servo = Servo(
        ARM, CAMERA, [Term(ImageBased(), 1.0), Term(ImageBased(feature=Area), 0.5)],
        solver=PseudoInverse(), depth_m=depth,
        situation=Situation(PERIOD, MotionSettings(False, False)),
    )  # fmt: skip
    q = START + 0.03
    for _ in range(300):
        points, _ = seen(ARM, q, world)
        q = q + PERIOD * commanded(servo, points, desired, q).velocity
    np.testing.assert_allclose(seen(ARM, q, world)[0], desired, atol=0.1)


@part("limit")
class Slower:
    """Keeps the first joint slower than a speed."""

    speed: float = knob(0.002, "rad/s", above=0)

    def rows(self, arm, q, velocity, period_s):
        C = np.zeros((2, arm.joint_count))
        C[:, 0] = -1.0, 1.0
        return C, np.full(2, -self.speed)


def test_a_limit_of_ones_own_is_kept_and_named():
    points, depth = seen(ARM, START, WORLD)
    free, kept = (
        Servo(
            ARM, CAMERA, ImageBased(gain=5.0, interaction="current"), depth_m=depth,
            limits=Limits(manipulability_share=0.0, own=own),
        )
        for own in ((), (Slower(),))
    )  # fmt: skip
    desired = points + [0.0, 60.0]
    assert abs(commanded(free, points, desired).velocity[0]) > 0.004
    command = commanded(kept, points, desired)
    assert abs(command.velocity[0]) <= 0.002 + 1e-9
    assert "Slower" in command.active


@part("objective")
class Nonsense:
    """Returns what is not finite."""

    def quadratic(self, state):
        return Quadratic(np.full((6, 6), np.nan), np.zeros(6))


def test_an_objective_that_returns_nonsense_is_named_with_its_file_and_line():
    points, depth = seen(ARM, START, WORLD)
    servo = Servo(ARM, CAMERA, Nonsense(), depth_m=depth)
    with pytest.raises(
        PartError, match=r"Nonsense: quadratic \(.*test_servo.py:\d+\) returned num"
    ):
        commanded(servo, points, points)


@pytest.mark.parametrize(
    ("E", "desired", "weight", "named"),
    [(7, 8, 8, "desired"), (8, 7, 8, "desired"), (8, 8, 7, "weight")],
)
def test_least_squares_of_rows_that_do_not_fit_are_refused(E, desired, weight, named):
    with pytest.raises(ShapeError, match=named):
        least_squares(np.zeros((E, 6)), np.zeros(desired), np.ones(weight))


def test_points_that_make_no_feature_lose_the_target_with_a_reason():
    """A line that passes through the optical centre is a point in the image."""
    points, depth = seen(ARM, START, WORLD)
    servo = Servo(ARM, CAMERA, ImageBased(feature=Lines), depth_m=depth)
    end_on = points.copy()
    end_on[1] = end_on[0]
    command = commanded(servo, end_on, points)
    assert command.fault is not None
    assert command.fault[0] is OutcomeKind.TARGET_LOST
    assert command.fault[1] == "lines: two ends of a segment that coincide; needs distinct ends"
    assert not command.velocity.any()


def test_a_camera_velocity_is_kept_along_its_axes_and_leaves_the_others():
    points, depth = seen(ARM, START, WORLD)
    moved = points + [4.0, 0.0]
    alone = ImageBased(feature=Centre)
    both = [alone, CameraVelocity((0.0, 0.0, 0.03))]
    servos = [Servo(ARM, CAMERA, what, depth_m=depth) for what in (alone, both)]
    before, after = (commanded(servo, moved, points).v_camera for servo in servos)
    assert abs(before[2]) < 0.01
    assert after[2] == pytest.approx(0.03, abs=1e-3)
    L = Centre(CAMERA.normalize(moved), depth).interaction()
    np.testing.assert_allclose(L @ after, L @ before, atol=1e-3)
    with pytest.raises(InputError, match="linear_m_s"):
        CameraVelocity((1.0, 2.0))


def test_without_any_features_the_arm_is_asked_to_stand():
    _, depth = seen(ARM, START, WORLD)
    servo = Servo(
        ARM, {"a": AT_TIP, "b": AT_TIP}, [Term(ImageBased()), Term(ImageBased(), camera="b")],
        depth_m={"a": depth, "b": depth},
    )  # fmt: skip
    joints = JointState(0.0, START, np.zeros(6))
    assert not servo.command(Observation(0.0, ()), Reference(0.0), joints).velocity.any()
    with pytest.raises(InputError, match="did you mean a"):
        Servo(ARM, {"a": AT_TIP}, [Term(ImageBased(), camera="aa")])


@pytest.mark.parametrize("objective", [ImageBased(feature=Centre), PointPose()])
def test_a_second_camera_that_finds_nothing_leaves_the_arm_to_the_first(objective):
    points, depth = seen(ARM, START, WORLD)
    desired = points + [20.0, -10.0]
    one = Servo(ARM, CAMERA, ImageBased(), depth_m=depth)
    both = Servo(
        ARM, {"wrist": AT_TIP, "wall": GENERAL}, [ImageBased(), Term(objective, camera="wall")],
        depth_m={"wrist": depth, "wall": depth},
    )  # fmt: skip
    (view,) = observed(points).views
    blind = view._replace(camera="wall", found=np.zeros(len(points), dtype=np.bool_))
    reference = Reference(0.0, desired, elsewhere_px={"wall": desired})
    joints = JointState(0.0, START, np.zeros(6))
    command = both.command(Observation(0.0, (view, blind)), reference, joints)
    assert command.fault is None
    np.testing.assert_allclose(command.velocity, commanded(one, points, desired).velocity)
