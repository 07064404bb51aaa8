"""Limits: constraint rows of the quadratic program, hard or relaxed by priority."""

from vergence.control.limits._rows import (
    COLLISION,
    KIND_NAMES,
    RELAXED,
    SINGULARITY,
    VIEW,
    ConstraintSettings,
    pack_features,
)
from vergence.control.limits.collision import CollisionLimit, braked, braking_rows, collision_rows
from vergence.control.limits.facing import facing_rows, flat_face
from vergence.control.limits.limits import Limit, Limits
from vergence.control.limits.occlusion import AXES, COLUMNS, HALF, MIDDLE, NO_SOLIDS, RADIUS
from vergence.control.limits.target_view import TargetView

__all__ = [
    "AXES",
    "COLLISION",
    "COLUMNS",
    "CollisionLimit",
    "ConstraintSettings",
    "HALF",
    "KIND_NAMES",
    "Limit",
    "Limits",
    "MIDDLE",
    "NO_SOLIDS",
    "RADIUS",
    "RELAXED",
    "SINGULARITY",
    "TargetView",
    "VIEW",
    "braked",
    "braking_rows",
    "collision_rows",
    "facing_rows",
    "flat_face",
    "pack_features",
]
