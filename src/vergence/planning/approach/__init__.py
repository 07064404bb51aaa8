"""Approaching a photograph: recognise it, plan a path, follow it, re-check, arrive."""

from vergence.planning.approach.approach import Approach
from vergence.planning.approach.goal import ApproachSettings, GoalImage, KnownLength
from vergence.planning.approach.search import Plan
from vergence.planning.approach.worker import InlineWorker, ThreadWorker, Worker

__all__ = [
    "Approach",
    "ApproachSettings",
    "GoalImage",
    "InlineWorker",
    "KnownLength",
    "Plan",
    "ThreadWorker",
    "Worker",
]
