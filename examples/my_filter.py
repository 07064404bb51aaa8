"""A filter of your own: in a cell beside it, filter = "my_filter:Stationary" under [perception].

A filter is a value: what it believes of the target is handed in and returned.
"""

from dataclasses import replace

import numpy as np

import vergence as vg
from vergence.estimation import Belief, PoseFilter, Seen, Update


@vg.part("filter")
class Stationary:
    """Believes that the target is at rest whenever an image says that it moves slowly."""

    slow_m_s: float = vg.knob(0.005, "m/s", least=0, upto=1)  # up to this it is at rest

    def start(
        self,
        time: float,
        T_world_target: np.ndarray,
        velocity: np.ndarray | None = None,
        covariance: np.ndarray | None = None,
    ) -> Belief:
        """Return the belief to start from."""
        return PoseFilter().start(time, T_world_target, velocity, covariance)

    def predict(self, belief: Belief, time: float) -> Belief:
        """Return the belief at another time."""
        return PoseFilter().predict(belief, time)

    def update(self, belief: Belief, seen: Seen) -> Update:
        """Correct the belief by the points of an image."""
        update = PoseFilter().update(belief, seen)
        if np.linalg.norm(update.belief.velocity[:3]) > self.slow_m_s:
            return update
        return update._replace(belief=replace(update.belief, velocity=np.zeros(6)))


if __name__ == "__main__":
    perception = {"filter": "my_filter:Stationary"}
    print(vg.run("lippiello2005", images=False, duration_s=0.3, perception=perception).outcome)
