"""Parts by role and name: those that ship, those of installed packages, and a user's own.

Nothing is imported before it is asked for.
"""

import importlib
import importlib.util
import sys
from collections.abc import Callable, Iterable, Mapping
from functools import cache
from hashlib import sha256
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from typing import Any

from vergence.errors import InputError, listed, nearest
from vergence.raised import raised

ENTRY_POINTS = "vergence.parts"  # each named ROLE.KIND, such as "objective.centre"

_CONTROL = "vergence.control"
_MOTIONS = "vergence.simulation.motions"
_ENDS = "vergence.runtime.task_ends"
_PLANNING, _ESTIMATION, _VISION = "vergence.planning", "vergence.estimation", "vergence.vision"
BUILT_IN: Mapping[str, Mapping[str, str]] = {
    "feature": {
        "centre": "vergence.features:Centre",
        "ellipse": "vergence.features:Ellipse",
        "lines": "vergence.features:Lines",
        "log_depth": "vergence.features:LogDepth",
        "moments": "vergence.features:Moments",
        "orientation": "vergence.features:Orientation",
        "points": "vergence.features:Points",
        "points_3d": "vergence.features:Points3d",
        "polar_points": "vergence.features:PolarPoints",
        "region_moments": "vergence.features:RegionMoments",
        "segments": "vergence.features:Segments",
        "size": "vergence.features:Size",
        "spherical_points": "vergence.features:SphericalPoints",
        "vanishing_point": "vergence.features:VanishingPoint",
    },
    "objective": {
        "camera_velocity": f"{_CONTROL}.objectives:CameraVelocity",
        "image_based": f"{_CONTROL}.objectives:ImageBased",
        "optimal_tracking": f"{_CONTROL}.objectives:OptimalTracking",
        "position_based": f"{_CONTROL}.objectives:PositionBased",
        "point_pose": f"{_CONTROL}.objectives:PointPose",
        "posture": f"{_CONTROL}.objectives:Posture",
    },
    "gain": {"adaptive": f"{_CONTROL}:AdaptiveGain"},
    "limit": {},
    "driver": {
        "franka": "vergence.drivers.franka:Franka",
        "ros2": "vergence.drivers.ros2:Ros2",
        "socket": "vergence.drivers.socket_robot:SocketRobot",
        "so101": "vergence.drivers.so101:So101",
        "ur": "vergence.drivers.ur:Ur",
    },
    "camera_source": {
        "gige": "vergence.drivers.cameras:Gige",
        "realsense": "vergence.drivers.cameras:RealSense",
        "video": "vergence.drivers.cameras:Video",
    },
    "matcher": {
        "in_turn": f"{_VISION}.matching:InTurn",
        "sift": f"{_VISION}.matching:Sift",
        "xfeat": f"{_VISION}.matching.learned:XFeat",
    },
    "planner": {
        "optimised": f"{_PLANNING}:OptimisedPlanner",
        "potential_field": f"{_PLANNING}:PotentialFieldPlanner",
    },
    "filter": {"pose": f"{_ESTIMATION}:PoseFilter", "rpy": f"{_ESTIMATION}:RpyPoseFilter"},
    "tracker": {
        "ssd": f"{_VISION}:SsdTracking",
        "round_marks": f"{_VISION}.marks:MarkTracking",
        "tags": f"{_VISION}.marks:TagTracking",
        "ellipse": f"{_VISION}.curves:EllipseTracking",
        "lines": f"{_VISION}.curves:LineTracking",
        "region": f"{_VISION}.curves:RegionTracking",
    },
    "motion": {
        "stationary": f"{_MOTIONS}:Stationary",
        "line": f"{_MOTIONS}:Line",
        "circle": f"{_MOTIONS}:Circle",
        "step": f"{_MOTIONS}:Step",
        "random": f"{_MOTIONS}:Random",
        "poses": f"{_MOTIONS}:PoseMotion",
    },
    "task_end": {
        "joint": f"{_ENDS}:JointPosition",
        "pose": f"{_ENDS}:CameraPosition",
        "reached": f"{_ENDS}:Reached",
        "seen": f"{_ENDS}:TargetSeen",
        "time": f"{_ENDS}:TimeOver",
    },
    "arm_motion": {"joints": f"{_MOTIONS}:JointMotion", "poses": f"{_MOTIONS}:PoseMotion"},
    "depth": {
        "from_camera": f"{_CONTROL}.depth:DepthFromCamera",
        "from_features": f"{_CONTROL}.depth:DepthFromFeatures",
        "from_pose": f"{_CONTROL}.depth:DepthFromPose",
        "from_motion": f"{_CONTROL}.depth:DepthFromMotion",
        "carried": f"{_CONTROL}.depth:CarriedDepth",
        "held": f"{_CONTROL}.depth:HeldDepth",
    },
    "limits": {"limits": f"{_CONTROL}.limits:Limits"},
    "servo": {"servo": f"{_CONTROL}:ServoSettings"},
    "law": {},
    "term": {"term": f"{_CONTROL}:WeightedObjective"},
    "solver": {
        "quadratic_program": f"{_CONTROL}.solvers:QuadraticProgram",
        "pseudo_inverse": f"{_CONTROL}.solvers:PseudoInverse",
        "damped_pseudo_inverse": f"{_CONTROL}.solvers:DampedPseudoInverse",
    },
}
# What a part must have, by its role.
METHODS: Mapping[str, tuple[str, ...]] = {
    "feature": ("value", "error", "interaction"),
    "objective": ("quadratic",),
    "limit": ("rows",),
    "law": ("bind",),
    "depth": ("estimates_motion", "bind"),
    "motion": ("poses",),
    "planner": ("plan",),
    "filter": ("start", "predict", "update"),
    "tracker": ("start",),
    "task_end": ("bind",),
    "camera_source": ("open",),
    "matcher": ("describe", "match"),
}


def kinds(role: str) -> tuple[str, ...]:
    """Return the names of the parts of a role that ship or are installed."""
    return tuple(sorted({*BUILT_IN.get(role, {}), *_installed(role)}))


class IncompletePartError(InputError):
    """A class that is declared for a role, but lacks a method of it."""


def find(
    role: str,
    kind: str,
    *,
    folder: Path | None = None,
    source: str = "part",
    key: str = "kind",
    or_role: str = "",
) -> Any:
    """Return the class of a part.

    Args:
        role: what it is for.
        kind: its name, or ``module:Class`` for one of a user's own: in a file beside the cell or
            in the current folder, or in an installed package.
        folder: where the cell lies.
        source: the file that names it, for messages.
        key: where in that file.
        or_role: another role whose parts may stand there, for messages.

    Raises:
        InputError: if there is no such part, it cannot be imported or does not fit the role.
    """
    dotted = BUILT_IN.get(role, {}).get(kind) or _installed(role).get(kind) or kind
    if ":" not in dotted:
        allowed = f"{nearest(kind, kinds(role))}, or module:Class"
        raise InputError(source, key, kind, allowed)
    name, _, attribute = dotted.partition(":")

    declared_by = " or ".join(map(_declaration, filter(None, (role, or_role))))
    allowed = f"a class {declared_by}"

    def refuse(why: str) -> InputError:
        return InputError(source, key, f"{kind}, {why}", allowed)

    try:
        module = _own_module(name, folder, Path.cwd()) or importlib.import_module(name)
    except ModuleNotFoundError as error:
        if error.name not in (name, name.partition(".")[0]):
            raise refuse(f"whose module needs {error.name}, which is not installed") from None
        places = " or ".join(str(each) for each in dict.fromkeys((folder, Path.cwd())) if each)
        raise refuse(f"but no {name}.py is in {places}, and no such package is installed") from None
    except ImportError as error:
        raise refuse(f"which cannot be imported ({error})") from None
    except Exception as error:
        why = f"whose module raised {raised(error)}"
        raise refuse(why) from error
    found = getattr(module, attribute, None)
    if found is None:
        known = [each for each, value in vars(module).items() if hasattr(value, "__part_roles__")]
        raise refuse(f"but {name} has no {attribute}; its parts: {nearest(attribute, known)}")
    if not isinstance(found, type):
        raise refuse("which is not a class")
    declared = getattr(found, "__part_roles__", ())
    if role not in declared:
        what = f"declared as {' and '.join(declared) or 'nothing'}"
        raise refuse(f"which is {what}")
    missing = [method for method in METHODS.get(role, ()) if not hasattr(found, method)]
    if missing:
        given, methods = f"{kind}, which has no method {missing[0]}", METHODS[role]
        some = f"the method{'s' if len(methods) > 1 else ''} {listed(methods)}"
        raise IncompletePartError(source, key, given, f"a class with {some}")
    if ":" in kind:
        found.__part_kind__ = kind  # type: ignore[attr-defined]
    return found


def _declaration(role: str) -> str:
    """Say how a class is declared for a role."""
    if role == "driver":
        return "that inherits from vg.Driver"
    own = role in ("objective", "feature")
    return f"declared with @vg.{role}" if own else f'declared with @vg.part("{role}")'


def _installed(role: str) -> dict[str, str]:
    begin = f"{role}."
    return {
        point.name.removeprefix(begin): point.value
        for point in _entry_points(entry_points)
        if point.name.startswith(begin)
    }


@cache
def _entry_points(read: Callable[..., Iterable[EntryPoint]]) -> tuple[EntryPoint, ...]:
    """Return the entry points of installed packages; reading them takes as long as a short run."""
    return tuple(read(group=ENTRY_POINTS))


def _own_module(name: str, *folders: Path | None) -> Any:
    """Return the module in a file of the first folder that has one, None if none has.

    It is kept under a name of its own, so that two cells may each have their ``mine.py``.
    """
    relative = Path(*name.split(".")).with_suffix(".py")
    files = (folder / relative for folder in folders if folder is not None)
    file = next(filter(Path.is_file, files), None)
    if file is None:
        return None
    text = file.read_bytes()
    label = f"vergence_beside_{sha256(str(file.resolve()).encode() + text).hexdigest()[:16]}_{name}"
    if label in sys.modules:
        return sys.modules[label]
    spec = importlib.util.spec_from_file_location(label, file)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[label] = module
    try:
        spec.loader.exec_module(module)
    except BaseException:
        del sys.modules[label]
        raise
    return module
