"""An arm as controllers see it: kinematics and limits."""

from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Self

import numpy as np
from numpy.typing import ArrayLike

from vergence.arrays import BoolArray, FloatArray, as_floats, frozen, read_only
from vergence.errors import Absent, InputError, nearest
from vergence.robot.chain import Chain, forward_kinematics, jacobian

if TYPE_CHECKING:
    import mujoco

# Defaults where neither the model nor the user gives a limit: rad/s, m/s, rad/s², m/s².
RATE, SLIDING_RATE, ACCELERATION, SLIDING_ACCELERATION = np.pi, 0.5, 4 * np.pi, 2.0
_ROUNDING = 1e-3  # relative tolerance for a limit that was written in degrees


@dataclass(frozen=True, slots=True)
class Arm:
    """Joints from the world to a tip (a camera or a tool), with their limits."""

    names: tuple[str, ...]  # of the joints that can be commanded, from the base outwards
    chain: Chain  # its axes, m ≥ n: a joint that others follow moves several axes
    q_min: FloatArray  # (n,) rad or m, -inf where there is no limit
    q_max: FloatArray  # (n,)
    rate_max: FloatArray  # (n,) rad/s or m/s
    acceleration_max: FloatArray  # (n,) rad/s² or m/s²
    axis_names: tuple[str, ...] = ()  # (m,) names of the chain's axes; `names` if empty

    def __post_init__(self) -> None:
        n = len(self.names)
        object.__setattr__(self, "axis_names", self.axis_names or self.names)
        object.__setattr__(self, "chain", Chain(*map(read_only, self.chain)))
        for name in ("q_min", "q_max", "rate_max", "acceleration_max"):
            object.__setattr__(self, name, frozen(getattr(self, name), (n,), name))
        for joint, low, high in zip(self.names, self.q_min, self.q_max, strict=True):
            if not low < high:
                raise InputError(
                    "arm", f"limits of {joint}", f"{low:g} … {high:g}", "lower below upper"
                )
        for name in ("rate_max", "acceleration_max"):
            if not (getattr(self, name) > 0).all():
                raise InputError("arm", name, getattr(self, name), "positive numbers")

    def __reduce__(self) -> tuple[type[Self], tuple[object, ...]]:
        """Make it anew: the arrays of a pickle may be written to, and kernels are for others."""
        return type(self), tuple(getattr(self, each.name) for each in fields(self))

    @property
    def limits(self) -> FloatArray:
        """Rows q_min, q_max, rate_max, acceleration_max, (4, n), as kernels take them."""
        return np.vstack((self.q_min, self.q_max, self.rate_max, self.acceleration_max))

    @classmethod
    def from_urdf(cls, path: str | Path, tip: str) -> Self:
        """Read the joints that carry a link, with their limits, from a URDF.

        Args:
            path: the file; an xacro must be expanded first.
            tip: name of the link at the end of the chain, such as "tool0".

        Raises:
            InputError: if the file or the link does not exist, or the file asks for something that
                is not supported.
        """
        from vergence.robot.urdf import read_urdf

        if not Path(path).is_file():
            raise InputError(str(path), "", Absent("no such file"), "a URDF file")
        return cls.from_mujoco(read_urdf(Path(path), tip).compile(), tip, kind="body")

    def with_tip(self, T_tip_new: ArrayLike) -> Self:
        """Return the arm with another tip that is fixed to its own, such as a mounted camera.

        Args:
            T_tip_new: (4, 4) pose of the new tip in the frame of the present one, such as
                T_flange_camera from a hand-eye calibration.

        Raises:
            InputError: if it is not a rigid motion.
        """
        T = as_floats(T_tip_new, (4, 4), "T_tip_new")
        R, p = T[:3, :3], T[:3, 3]
        rigid = np.allclose(R.T @ R, np.eye(3), atol=1e-6) and np.linalg.det(R) > 0
        if not (rigid and np.isfinite(p).all() and (T[3] == (0.0, 0.0, 0.0, 1.0)).all()):
            raise InputError("with_tip", "T_tip_new", T.tolist(), "a rotation and a translation")
        rotation, position = self.chain.rotation.copy(), self.chain.position.copy()
        position[-1] += rotation[-1] @ p
        rotation[-1] = rotation[-1] @ R
        chain = self.chain._replace(rotation=frozen(rotation), position=frozen(position))
        return replace(self, chain=chain)

    @classmethod
    def from_mujoco(
        cls,
        model: "mujoco.MjModel",
        tip: str,
        rate_max: float | FloatArray | None = None,
        acceleration_max: float | FloatArray | None = None,
        kind: str = "camera",
    ) -> Self:
        """Read the joints that carry a camera, site or body from a MuJoCo model.

        Args:
            model: any compiled model.
            tip: name of the camera, site or body at the end of the chain. A camera's frame is
                converted to OpenCV's convention: z forward, x right, y down.
            rate_max: joint rate limits, one for all or (n,), rad/s or m/s; at most those of the
                model, which are the default. Where the model has none: π rad/s or 0.5 m/s.
            acceleration_max: joint acceleration limits, one for all or (n,); 4π rad/s² or 2 m/s² by
                default.
            kind: "camera", "site" or "body".

        Raises:
            InputError: if the tip does not exist, no joint carries it, a joint has more than one
                degree of freedom, joints are coupled in a way that is not supported, or limits are
                reversed, too few, or looser than the model's.
        """
        from vergence.robot.mujoco_chain import read_chain

        read = read_chain(model, tip, kind)
        n = len(read.names)
        sliding = _of_joints(read.chain.sliding, read.names, read.axis_names)
        if rate_max is None:
            known, guessed = np.isfinite(read.rate_max), np.where(sliding, SLIDING_RATE, RATE)
            rate_max = np.where(known, read.rate_max, guessed)
        if acceleration_max is None:
            acceleration_max = np.where(sliding, SLIDING_ACCELERATION, ACCELERATION)
        return cls(
            read.names,
            read.chain,
            read.limits[:, 0],
            read.limits[:, 1],
            _within(_one_each(rate_max, n, "rate_max"), read.rate_max, read.names),
            _one_each(acceleration_max, n, "acceleration_max"),
            read.axis_names,
        )

    @property
    def joint_count(self) -> int:
        """Number of joints n."""
        return len(self.names)

    @property
    def sliding(self) -> BoolArray:
        """True for each prismatic joint, (n,)."""
        return _of_joints(self.chain.sliding, self.names, self.axis_names)

    def forward_kinematics(self, q: ArrayLike) -> FloatArray:
        """Return T_world_tip (4, 4) at joint positions q (n,)."""
        T: FloatArray = forward_kinematics(self.chain, frozen(q, (self.joint_count,), "q"))
        return T

    def jacobian(self, q: ArrayLike) -> FloatArray:
        """Return the Jacobian (6, n) of the tip in its own frame: v_tip = J q̇."""
        J: FloatArray = jacobian(self.chain, frozen(q, (self.joint_count,), "q"))
        return J

    def axis_positions(self, q: FloatArray) -> FloatArray:
        """Return the positions of all axes of the chain, (m,), at joints q (n,), rad or m."""
        positions = frozen(q, (self.joint_count,), "q")
        if len(self.chain.coupling) == 0:
            return positions
        joint, ratio, offset = self.chain.coupling.T
        moved: FloatArray = ratio * positions[joint.astype(int)] + offset
        return moved

    def outside(self, q: ArrayLike) -> BoolArray:
        """Return which joints of q (n,) are at or beyond a limit, (n,)."""
        q = as_floats(q, (self.joint_count,), "q")
        result: BoolArray = (q <= self.q_min) | (q >= self.q_max)
        return result

    def normalized(self, q: ArrayLike) -> FloatArray:
        """Return q (…, n) scaled so that the limits are -1 and 1; 0 for a joint without limits."""
        q = np.asarray(q, dtype=np.float64)
        limited = np.isfinite(self.q_max - self.q_min)
        low, high = np.where(limited, self.q_min, -1.0), np.where(limited, self.q_max, 1.0)
        result: FloatArray = np.where(limited, (2 * q - low - high) / (high - low), 0.0)
        return result

    def index(self, joint: str) -> int:
        """Return the index of a joint.

        Raises:
            InputError: if the arm has no such joint.
        """
        if joint not in self.names:
            raise InputError("arm", "joint", joint, nearest(joint, self.names))
        return self.names.index(joint)


def _of_joints(
    axes: BoolArray | FloatArray, names: tuple[str, ...], axis_names: tuple[str, ...]
) -> BoolArray:
    """Reduce values of all axes (m,) to those of the joints, (n,)."""
    own: BoolArray = np.array([bool(axes[axis_names.index(name)]) for name in names])
    return own


def _within(rate_max: FloatArray, most: FloatArray, names: tuple[str, ...]) -> FloatArray:
    """Return rate limits (n,) clamped to the model's; reject one beyond rounding."""
    for joint, rate, limit in zip(names, rate_max, most, strict=True):
        if rate > limit * (1 + _ROUNDING):
            allowed = f"up to {limit:g}, the model's velocity limit"
            raise InputError("arm", f"rate_max of {joint}", f"{rate:g}", allowed)
    return np.minimum(rate_max, most)


def _one_each(values: float | FloatArray, n: int, name: str) -> FloatArray:
    given = np.asarray(values, dtype=np.float64)
    if given.shape not in ((), (n,)):
        raise InputError("arm", name, f"{given.size} values", f"one value, or {n}: one per joint")
    return np.broadcast_to(given, (n,))
