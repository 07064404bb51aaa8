"""An arm as a controller sees it."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Self

import numpy as np

from vergence.arrays import BoolArray, FloatArray, frozen
from vergence.errors import InputError, nearest
from vergence.robot.chain import Chain, forward_kinematics, jacobian

if TYPE_CHECKING:
    import mujoco


@dataclass(frozen=True, slots=True)
class Arm:
    """Joints from the world to a tip (a camera or a tool), with their limits."""

    names: tuple[str, ...]  # of the joints, from the base outwards
    chain: Chain
    q_min: FloatArray  # (n,) rad or m, -inf where there is no limit
    q_max: FloatArray  # (n,)
    rate_max: FloatArray  # (n,) rad/s or m/s
    acceleration_max: FloatArray  # (n,) rad/s² or m/s²

    def __post_init__(self) -> None:
        n = len(self.names)
        for name in ("q_min", "q_max", "rate_max", "acceleration_max"):
            object.__setattr__(self, name, frozen(getattr(self, name), (n,), name))
        for joint, low, high in zip(self.names, self.q_min, self.q_max, strict=True):
            if not low < high:
                raise InputError(
                    "arm", f"limits of {joint}", f"{low:g} … {high:g}", "lower below upper"
                )
        for name in ("rate_max", "acceleration_max"):
            if not (getattr(self, name) > 0).all():
                raise InputError("arm", name, getattr(self, name), "numbers above zero")

    @classmethod
    def from_mujoco(
        cls,
        model: "mujoco.MjModel",
        tip: str,
        rate_max: float | FloatArray = np.pi,
        acceleration_max: float | FloatArray = 4 * np.pi,
        kind: str = "camera",
    ) -> Self:
        """Read the joints that carry a camera, site or body off a MuJoCo model.

        Args:
            model: any compiled model.
            tip: name of the camera, site or body at the end of the chain. A camera's frame is
                turned to OpenCV's convention: z forward, x right, y down.
            rate_max: joint rate limits, one for all or (n,), rad/s or m/s.
            acceleration_max: joint acceleration limits, likewise.
            kind: "camera", "site" or "body".

        Raises:
            InputError: if there is no such tip, no joint carries it, a joint has more than one
                degree of freedom, or limits are the wrong way round or too few.
        """
        from vergence.robot.mujoco_chain import read_chain

        names, chain, limits = read_chain(model, tip, kind)
        n = len(names)
        return cls(
            names,
            chain,
            limits[:, 0],
            limits[:, 1],
            _one_each(rate_max, n, "rate_max"),
            _one_each(acceleration_max, n, "acceleration_max"),
        )

    @property
    def joint_count(self) -> int:
        """Number of joints n."""
        return len(self.names)

    def forward_kinematics(self, q: FloatArray) -> FloatArray:
        """Return T_world_tip (4, 4) at joint positions q (n,)."""
        T: FloatArray = forward_kinematics(self.chain, frozen(q, (self.joint_count,), "q"))
        return T

    def jacobian(self, q: FloatArray) -> FloatArray:
        """Return the tip's Jacobian (6, n) in the tip's own axes: v_tip = J q̇."""
        J: FloatArray = jacobian(self.chain, frozen(q, (self.joint_count,), "q"))
        return J

    def outside(self, q: FloatArray) -> BoolArray:
        """Tell which joints of q (n,) are at or beyond a limit, (n,)."""
        result: BoolArray = (q <= self.q_min) | (q >= self.q_max)
        return result

    def normalized(self, q: FloatArray) -> FloatArray:
        """Return q (…, n) with its limits at -1 and 1; 0 for a joint without limits."""
        q = np.asarray(q, dtype=np.float64)
        limited = np.isfinite(self.q_max - self.q_min)
        low, high = np.where(limited, self.q_min, -1.0), np.where(limited, self.q_max, 1.0)
        result: FloatArray = np.where(limited, (2 * q - low - high) / (high - low), 0.0)
        return result

    def index(self, joint: str) -> int:
        """Return the place of a joint in the chain.

        Raises:
            InputError: if the arm has no such joint.
        """
        if joint not in self.names:
            raise InputError("arm", "joint", joint, nearest(joint, self.names))
        return self.names.index(joint)


def _one_each(values: float | FloatArray, n: int, name: str) -> FloatArray:
    given = np.asarray(values, dtype=np.float64)
    if given.shape not in ((), (n,)):
        raise InputError("arm", name, f"{given.size} values", f"one, or {n}, one a joint")
    return np.broadcast_to(given, (n,))
