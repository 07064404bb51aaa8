"""An objective of your own: in Python, and as kind = "mine:Centre" in a cell beside this file.

The same class is compared with others by: vergence compare CELL --laws own,mine:Centre
"""

import vergence as vg


@vg.objective
class Centre:
    """Keeps the middle of the features in the middle of the image, whatever else happens."""

    gain: vg.Positive = vg.knob(1.0, "1/s", upto=20)  # how fast the error decays

    def quadratic(self, state: vg.CameraState) -> vg.Quadratic:
        """Return the quadratic for this tick."""
        L = state.features.interaction().reshape(-1, 2, 6).mean(axis=0)
        error, drift = state.points.mean(axis=0), state.flow.mean(axis=0)
        return vg.least_squares(L, -self.gain * error - drift, damping=1e-3)


if __name__ == "__main__":
    run = vg.run("puma560", images=False, duration_s=1, law={"kind": "mine:Centre"})
    print(run.outcome)
