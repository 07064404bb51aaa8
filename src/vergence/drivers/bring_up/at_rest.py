"""Checks of clocks, joints and images while the arm is at rest."""

from collections.abc import Iterator, Mapping

import numpy as np

from vergence.camera import Camera
from vergence.drivers.bring_up.finding import Finding
from vergence.drivers.bring_up.watched import Watched
from vergence.robot import Arm

_RATE_TOLERANCE, _CLOCK_TOLERANCE = 0.05, 0.01
_GAP_S = 0.05  # between two ticks, from which on set-points come too late
NOISE = 0.002  # rad or m by which joints at rest may scatter
_OLD_S = 0.3  # an image that arrives later than this is of little use


def clock_findings(seen: Watched, rate_hz: float) -> Iterator[Finding]:
    """Check the driver's clock against its rate and this computer's clock."""
    step = np.diff(seen.time)
    elapsed = seen.time[-1] - seen.time[0]
    rate = len(step) / elapsed if elapsed > 0 else 0.0
    yield Finding(
        "rate of the set-points",
        rate,
        "Hz",
        f"{rate_hz:g} ± 5 %",
        abs(rate / rate_hz - 1.0) <= _RATE_TOLERANCE,
        "the robot runs at another rate, or the computer is too busy",
    )
    yield Finding(
        "longest time between two ticks",
        1e3 * float(step.max()),
        "ms",
        f"at most {1e3 * _GAP_S:g}",
        float(step.max()) <= _GAP_S,
        "use a cable, close other programs",
    )
    yield Finding(
        "steps of the clock backwards",
        float((step < 0).sum()),
        "",
        "none",
        bool((step >= 0).all()),
        "the robot's clock is set while it runs: end its time synchronisation",
    )
    drift = elapsed / (seen.wall[-1] - seen.wall[0]) - 1.0
    yield Finding(
        "drift of the robot's clock",
        100 * float(drift),
        "%",
        "at most 1",
        abs(drift) <= _CLOCK_TOLERANCE,
        "time stamps of another clock or in another unit; or a simulated robot is too slow",
    )


def joint_findings(seen: Watched, arm: Arm) -> Iterator[Finding]:
    """Check joints that should not move: their noise, and their place in the limits."""
    noise = float(np.ptp(seen.position, axis=0).max())
    yield Finding(
        "motion of joints at rest",
        1e3 * noise,
        "mrad or mm",
        f"at most {1e3 * NOISE:g}",
        noise <= NOISE,
        "a payload that is not set, or noisy encoders",
    )
    q = seen.position[-1]
    room = np.minimum(q - arm.q_min, arm.q_max - q)
    worst = int(np.argmin(room))
    yield Finding(
        f"room to the nearest limit ({arm.names[worst]})",
        float(room[worst]),
        "rad or m",
        "more than 0",
        bool(room[worst] > 0),
        "the model's zero is not the robot's, or its limits are not",
    )


def image_findings(
    seen: Watched, cameras: Mapping[str, Camera], rates_hz: Mapping[str, float]
) -> Iterator[Finding]:
    """Check of every camera the size, rate and age of its images."""
    seconds = seen.time[-1] - seen.time[0]
    for name, rate_hz in rates_hz.items():
        camera, frames = cameras[name], [(t, f) for t, f in seen.frames if f.camera == name]
        if not frames:
            yield Finding(f"images of {name}", 0, "", "some", False, "no image has come")
            continue
        height, width = (0, 0) if frames[-1][1].image is None else frames[-1][1].image.shape
        yield Finding(
            f"width of the images of {name}",
            width,
            "px",
            f"{camera.width} × {camera.height}",
            (width, height) == (camera.width, camera.height),
            f"they are {width} × {height}: the camera file is of another resolution",
        )
        rate = len(frames) / seconds
        yield Finding(
            f"image rate of {name}",
            rate,
            "Hz",
            f"{rate_hz:g} ± 20 %",
            abs(rate / rate_hz - 1.0) <= 0.2,
            "rate_hz of the cell is another, or images are dropped: exposure, cable, USB hub",
        )
        age = float(np.median([time - frame.time for time, frame in frames]))
        yield Finding(
            f"age of the images of {name} by their stamps",
            1e3 * age,
            "ms",
            f"0 to {1e3 * _OLD_S:g}",
            0.0 <= age <= _OLD_S,
            "time stamps from another clock; see `vergence calibrate --latency`",
        )
