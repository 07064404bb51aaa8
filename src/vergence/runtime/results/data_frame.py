"""A run as named columns: for pandas, and for a NumPy archive."""

from collections.abc import Iterator, Mapping
from dataclasses import fields
from typing import TYPE_CHECKING, Any

import numpy as np

from vergence.arrays import BoolArray, IntArray, pandas_or_error
from vergence.errors import InputError, nearest
from vergence.runtime.results.traces import ArmTrace, CameraTrace, TargetTrace

if TYPE_CHECKING:
    import pandas as pd

    from vergence.runtime.results.run import Run

AnyTrace = ArmTrace | CameraTrace | TargetTrace
_TWIST = ("vx", "vy", "vz", "wx", "wy", "wz")


def data_frame(run: "Run", of: str | None) -> "pd.DataFrame":
    """Return a run, or one of its arms, cameras or the target, as a table; see `Run.to_frame`."""
    pd = pandas_or_error()
    traces = _traces(run)
    if of is not None:
        if of not in traces:
            raise InputError("to_frame", "of", of, nearest(of, traces))
        trace = traces[of]
        return pd.DataFrame({"time": trace.time, **dict(_columns(trace, _joints(run, of)))})
    return pd.DataFrame(tick_columns(run))


def tick_columns(run: "Run") -> dict[str, Any]:
    """Return all values per tick except matrices, by names such as ``puma.position.joint1``.

    Values of an image are given at the tick in which the loop received it, and are unknown at the
    others.
    """
    table: dict[str, Any] = {"time": run.times}
    for name, trace in _traces(run).items():
        came = trace.time if isinstance(trace, ArmTrace) else trace.received
        last = np.searchsorted(came, run.times, side="right") - 1
        known = (last >= 0) & (np.append(came, np.nan)[last] == run.times)
        for column, values in _columns(trace, _joints(run, name), matrices=False):
            table[f"{name}.{column}"] = _at(values, last, known)
    return table


def _at(values: Any, rows: IntArray, known: BoolArray) -> Any:
    """Return the values at some rows, NaN where unknown."""
    if known.all():
        return [values[row] for row in rows] if isinstance(values, list) else values[rows]
    if isinstance(values, np.ndarray) and values.dtype == np.float64:
        return np.where(known, np.append(values, np.nan)[rows], np.nan)
    return [values[row] if there else np.nan for row, there in zip(rows, known, strict=True)]


def named_arrays(run: "Run") -> dict[str, Any]:
    """Return every numeric array of a run by a name such as ``puma.position``."""
    return {
        f"{name}.{one.name}": getattr(trace, one.name)
        for name, trace in _traces(run).items()
        for one in fields(trace)
        if one.metadata["kind"] in (float, bool)
    }


def _traces(run: "Run") -> dict[str, AnyTrace]:
    """Return every trace by its name; a camera with the name of an arm is distinguished."""
    cameras = {f"camera {n}" if n in run.arms else n: one for n, one in run.cameras.items()}
    target: Mapping[str, AnyTrace] = {} if run.target is None else {"target": run.target}
    others = {
        f"target {name}": other.target
        for name, other in run.others.items()
        if other.target is not None
    }
    seen = {
        f"target {name} {camera}": trace
        for name, other in run.others.items()
        for camera, trace in other.cameras.items()
    }
    return {**run.arms, **cameras, **target, **others, **seen}


def _joints(run: "Run", name: str) -> tuple[str, ...]:
    return run.info.arms[name].names if name in run.arms else ()


def _columns(
    trace: AnyTrace, joints: tuple[str, ...], matrices: bool = True
) -> Iterator[tuple[str, Any]]:
    """Yield the columns of a trace except its time, each number separately."""
    for one in fields(trace):
        values = getattr(trace, one.name)
        shape = one.metadata["shape"]
        if one.name == "time" or (not matrices and len([s for s in shape if s != "M"]) > 1):
            continue
        if one.metadata["kind"] in (tuple, dict):
            yield one.name, list(values)
            continue
        for index in np.ndindex(values.shape[1:]):
            words = [_label(s, i, joints) for s, i in zip(shape, index, strict=True)]
            yield ".".join([one.name, *words]), values[(slice(None), *index)]
    if isinstance(trace, CameraTrace):
        for point, error in enumerate(trace.error_px.T):
            yield f"error_px.{point}", error


def _label(size: int | str, index: int, joints: tuple[str, ...]) -> str:
    """Return the label of an index along an axis of a given size."""
    if size == "n":
        return joints[index]
    if size == 2:
        return "uv"[index]
    return _TWIST[index] if size == 6 else str(index)
