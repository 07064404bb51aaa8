"""Visual features: their values, and how they change when the camera moves."""

from vergence.features._moments import moments_of_polygon
from vergence.features.centre import Centre
from vergence.features.ellipse import Ellipse
from vergence.features.feature import Feature
from vergence.features.interaction import interaction_matrix_points
from vergence.features.lines import Lines
from vergence.features.log_depth import LogDepth
from vergence.features.luminance import Luminance
from vergence.features.moments import Moments, RegionMoments
from vergence.features.of_each import of_each
from vergence.features.orientation import Orientation
from vergence.features.plane import inverse_depth_plane
from vergence.features.points import Points
from vergence.features.points_3d import Points3d
from vergence.features.polar_points import PolarPoints
from vergence.features.segments import Segments
from vergence.features.size import Size
from vergence.features.spherical_points import SphericalPoints
from vergence.features.vanishing_point import VanishingPoint

__all__ = [
    "Centre",
    "Ellipse",
    "Feature",
    "Lines",
    "LogDepth",
    "Luminance",
    "Moments",
    "Orientation",
    "Points",
    "Points3d",
    "PolarPoints",
    "RegionMoments",
    "Segments",
    "Size",
    "SphericalPoints",
    "VanishingPoint",
    "interaction_matrix_points",
    "inverse_depth_plane",
    "moments_of_polygon",
    "of_each",
]
