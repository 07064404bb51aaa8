"""The numbers of a run at the top of its report."""

import re
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from vergence.app.figures.arm import CLEAR_OF, clearance, normalized
from vergence.app.figures.constraints import constraint_names
from vergence.app.figures.features import feature_errors
from vergence.arrays import FloatArray
from vergence.runtime import ArmInfo
from vergence.runtime.results import ADVICE, ArmTrace, CameraTrace, Run


@dataclass(frozen=True, slots=True)
class Row:
    """One line of a table."""

    name: str
    value: str
    unit: str = ""
    note: str = ""


def run_rows(run: Run) -> list[Row]:
    """Return the rows of the whole run, with the advice that the loop gave."""
    rows = [Row("run time", f"{run.duration:.2f}", "s", "from the first tick to the last")]
    if run.info.seed is not None:
        rows.append(Row("seed", str(run.info.seed), "", "of all random numbers"))
    rows += [
        Row(ADVICE[event.name], "some", "", event.text)
        for event in run.events
        if event.name in ADVICE
    ]
    return rows + [
        _summary_row(name, value)
        for name, value in run.summary.items()
        if name not in _DERIVED and value is not None
    ]


def task_rows(run: Run) -> list[Row]:
    """Return how each of several tasks ended."""
    return [
        Row(
            task.name,
            task.outcome.kind.value,
            "",
            f"{task.begun:.2f} to {task.outcome.time:.2f} s: {task.outcome.reason}",
        )
        for task in run.outcome.tasks
    ]


def camera_rows(trace: CameraTrace) -> list[Row]:
    """Return how well a camera's points were followed."""
    rows = [Row("images", str(len(trace.time)), "", "processed by the loop")]
    if asked := np.count_nonzero(trace.asked):
        share = np.count_nonzero(trace.found & trace.asked) / asked
        rows.append(Row("points found", f"{100 * share:.1f}", "%", "of the points searched for"))
    if (looked := np.count_nonzero(trace.asked.any(axis=1))) < len(trace.time):
        rows.insert(
            1, Row("images searched", str(looked), "", "in the others no corner was selected")
        )
    error, drift = _worst(trace.error_px), _worst(trace.drift_px)
    if len(error):
        note = f"farthest point from where the law wants it, last image that shows one{_lag(trace)}"
        rows.append(Row("final error", f"{error[-1]:.2f}", "px", note))
        rows.append(Row("largest error", f"{error.max():.2f}", "px", "farthest point, any image"))
    if len(drift):
        note = "distance of a tracked point from its true place"
        rows.append(Row("largest drift", f"{drift.max():.2f}", "px", note))
    if len(trace.time):
        late = 1e3 * float(np.median(trace.received - trace.time))
        rows.append(Row("age of an image", f"{late:.0f}", "ms", "median, when it is processed"))
    return rows


def _lag(trace: CameraTrace) -> str:
    """Return what to expect of the last error, if the target was moving then."""
    with_error = np.flatnonzero(np.isfinite(trace.error_px).any(axis=1))
    known = np.isfinite(trace.T_world_target[:, 0, 3])
    known[with_error[-1] + 1 if len(with_error) else 0 :] = False
    time, place = trace.time[known], trace.T_world_target[known, :3, 3]
    late = time >= time[-1] - _LATE_S if len(time) else np.empty(0, dtype=bool)
    if np.count_nonzero(late) < 2:
        return ""
    distance = float(np.linalg.norm(place[-1] - place[late][0]))
    speed = distance / float(time[-1] - time[late][0])
    if speed < _MOVING_M_S:
        return ""
    return f"; the target moves at {speed:.2g} m/s: a law without feed-forward lags behind it"


def arm_rows(info: ArmInfo, trace: ArmTrace) -> list[Row]:
    """Return how close an arm came to its limits."""
    return [
        *_feature_rows(trace),
        *_measure_rows(trace),
        *_clearance_rows(trace),
        *_limit_rows(info, trace),
    ]


def _feature_rows(trace: ArmTrace) -> Iterator[Row]:
    for feature, errors in feature_errors(trace).items():
        last = np.abs(errors[np.isfinite(errors).any(axis=1)][-1])
        note = "s − s*, in the feature's own unit, when the law last gave a command"
        if len(last) > 1:
            note = f"largest of its {len(last)} values of {note}"
        yield Row(f"final error of {feature}", f"{np.nanmax(last):.2g}", "", note)


def _measure_rows(trace: ArmTrace) -> Iterator[Row]:
    measure = trace.manipulability[np.isfinite(trace.manipulability)]
    if len(measure) and measure[0] > 0:
        ratio = measure.min() / measure[0]
        note = "w′ as a share of its value at the start"
        yield Row("least manipulability", f"{ratio:.2f}", "", note)
    penalty = trace.penalty[np.isfinite(trace.penalty)]
    if len(penalty):
        yield Row(
            "limit clearance P", f"{penalty.min():.2f}", "",
            "1 = far from every joint limit, 0 = at one",
        )  # fmt: skip


def _clearance_rows(trace: ArmTrace) -> Iterator[Row]:
    for kind, name in CLEAR_OF.items():
        distance = clearance(trace, kind)
        if np.isfinite(distance).any():
            nearest = int(np.nanargmin(distance))
            where = f"at {trace.time[nearest]:.2f}\u00a0s, as computed by the law"
            yield Row(f"least distance to {name}", f"{1e3 * distance[nearest]:.1f}", "mm", where)


def _limit_rows(info: ArmInfo, trace: ArmTrace) -> Iterator[Row]:
    """Yield rows of the set-points, which are guaranteed, and of the joints, which follow them."""
    for who, q, rates, note in (
        ("set-points", trace.setpoint, trace.setpoint_rate, "kept by the guard"),
        ("joints", trace.position, trace.velocity, "measured; a servo may overshoot"),
    ):
        position = np.abs(normalized(info, q))
        rate = np.abs(rates) / np.where(np.isfinite(info.rate_max), info.rate_max, np.nan)
        for name, shares in (("closest to a joint limit", position), ("fastest", rate)):
            if np.isfinite(shares).any():
                row, joint = np.unravel_index(np.nanargmax(shares), shares.shape)
                where = f"of the limit: {info.names[joint]} at {trace.time[row]:.2f}\u00a0s; {note}"
                yield Row(f"{who}: {name}", f"{100 * shares[row, joint]:.0f}", "%", where)


def constraint_rows(trace: ArmTrace) -> list[Row]:
    """Return how often each limit was active, and by how much it was relaxed."""
    return [_constraint_row(trace, name) for name in constraint_names(trace)]


def _constraint_row(trace: ArmTrace, name: str) -> Row:
    bent = np.array([slack.get(name, 0.0) for slack in trace.slack])
    shaped = np.array([name in active for active in trace.active]) | (bent > 0.0)
    note = "of the time"
    if bent.any():
        worst, first = int(np.argmax(bent)), int(np.argmax(bent > 0.0))
        note += (
            f"; relaxed in {np.count_nonzero(bent)} ticks from {trace.time[first]:.2f} s on, by "
            f"up to {bent[worst]:.2g} {_RATES.get(name, '1/s')} at {trace.time[worst]:.2f} s"
        )
    return Row(name, f"{100 * shaped.mean():.1f}", "%", note)


def _worst(distances: FloatArray) -> FloatArray:
    """Return the largest distance in each image that has one."""
    known = np.isfinite(distances).any(axis=1)
    return np.asarray(np.nanmax(distances[known], axis=1)) if known.any() else np.empty(0)


_LATE_S, _MOVING_M_S = 0.2, 1e-3  # how long before the end a target still counts as moving
_RATES = {
    "collision": "m/s",
    "joint margin": "rad/s or m/s",
}  # of limits that can be relaxed; the others have no length

_DERIVED = {  # what the rows of cameras and arms say as well, from the recording itself
    "duration_s",
    "final_error_px",
    "max_error_px",
    "max_drift_px",
    "min_manipulability_ratio",
    "min_penalty",
}

_NOTES = {
    "real_time": "simulated seconds per second of computation",
    "final_target_error": "between estimated and true target, last image",
    "max_target_error": "between estimated and true target, any image",
    "final_pose_error": "between the camera's true and desired pose, last image",
    "max_pose_error": "between the camera's true and desired pose, any image",
}

_OF_ONE_TARGET = re.compile("_target_.+_error$")  # in the name of a number
_OF_A_POSE = {"m": "position", "°": "rotation"}

_UNITS = {
    "_m_s": "m/s",
    "_rad_s": "rad/s",
    "_factor": "×",
    "_px": "px",
    "_ms": "ms",
    "_us": "µs",
    "_hz": "Hz",
    "_deg": "°",
    "_s": "s",
    "_m": "m",
}


def _summary_row(name: str, value: float | str) -> Row:
    """Read the unit off a name's end, as our names have it."""
    ending = next((end for end in _UNITS if name.endswith(end)), "")
    stem = name.removesuffix(ending)
    words = stem.replace("_", " ").replace("max ", "largest ").replace("min ", "least ")
    unit, note = _UNITS.get(ending, ""), _NOTES.get(_OF_ONE_TARGET.sub("_target_error", stem), "")
    if isinstance(value, str):
        return Row(words, value, unit, note)
    if note and unit in _OF_A_POSE:
        words += f", {_OF_A_POSE[unit]}"
    if unit == "m" and abs(value) < 0.1:
        value, unit = 1e3 * value, "mm"
    return Row(words, f"{value:.3g}", unit, note)
