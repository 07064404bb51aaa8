"""vergence: visual servoing that keeps the target in view and the arm clear of its limits.

``import vergence as vg`` is the public interface. Its names are loaded when they are first used, so
that the import itself takes milliseconds; `__init__.pyi` says what each of them is.
"""

from vergence.kernels.prebuilt import use_prebuilt_kernels as _use_prebuilt_kernels
from vergence.kernels.stale import forget_stale_kernels as _forget_stale_kernels

_ROOMS = {
    "app.report": ("report",),
    "app.tracking": ("track_points",),
    "assembly": ("plan", "run"),
    "camera": ("Camera", "read_camera"),
    "camera.calibration": ("calibrate_lens", "calibrate_mounting"),
    "cell": ("Cell", "load_cell"),
    "control": (
        "AdaptiveGain",
        "CameraState",
        "Guard",
        "ImageBased",
        "Limits",
        "OptimalTracking",
        "PositionBased",
        "Quadratic",
        "PseudoInverse",
        "QuadraticProgram",
        "Servo",
        "Term",
        "least_squares",
    ),
    "errors": ("InputError", "VergenceError"),
    "estimation": ("CornerView", "fit_pose"),
    "experiments": ("compare",),
    "features": ("Feature", "Points"),
    "parts": ("Positive", "feature", "knob", "objective", "part"),
    "robot": ("Arm",),
    "runtime": ("Driver", "Recorder", "Recording", "Run"),
    "signals": ("Frame", "OutcomeKind", "Sample", "Setpoint"),
    "vision": ("Board",),
    "simulation": ("SimulatedDriver",),
    "studies": ("reproduce",),
}
_PLACES = {name: room for room, names in _ROOMS.items() for name in names}

__all__ = sorted(_PLACES)

_use_prebuilt_kernels()
_forget_stale_kernels()


def __getattr__(name: str) -> object:
    """Load a public name, or the module of transforms, when it is first asked for."""
    from importlib import import_module

    if name == "transforms":
        return import_module("vergence.geometry.transforms")
    if name not in _PLACES:
        raise AttributeError(f"module 'vergence' has no attribute {name!r}")
    value = getattr(import_module(f"vergence.{_PLACES[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    """List the public names, loaded or not."""
    return sorted({*globals(), *__all__, "transforms"})
