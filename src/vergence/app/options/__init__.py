"""The options of the commands, one object each, declared once."""

from vergence.app.options.calibrate import CalibrateOptions
from vergence.app.options.campaign import CampaignOptions, CompareOptions, MapOptions
from vergence.app.options.check import CheckOptions
from vergence.app.options.goal import GoalOptions
from vergence.app.options.new import NewOptions
from vergence.app.options.plan import PlanOptions
from vergence.app.options.run import RunOptions
from vergence.app.options.shared import (
    CellName,
    Driver,
    ImageEvery,
    Images,
    Json,
    Out,
    Overwrite,
    Seed,
    Settings,
    folder_to_write,
)
from vergence.app.options.takes import as_typed, takes
from vergence.app.options.track import TrackOptions
from vergence.app.options.watch import WatchOptions

__all__ = [
    "CalibrateOptions",
    "CampaignOptions",
    "CellName",
    "CheckOptions",
    "CompareOptions",
    "Driver",
    "GoalOptions",
    "ImageEvery",
    "Images",
    "Json",
    "MapOptions",
    "NewOptions",
    "Out",
    "Overwrite",
    "PlanOptions",
    "RunOptions",
    "Seed",
    "Settings",
    "TrackOptions",
    "WatchOptions",
    "as_typed",
    "folder_to_write",
    "takes",
]
