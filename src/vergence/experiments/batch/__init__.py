"""Thousands of ideal runs at once: the loop as a kernel, and the loop itself beside it."""

from vergence.experiments.batch.kinematic_run import KinematicRun
from vergence.experiments.batch.run_batch import BatchTrace, covers, is_ready, run_batch

__all__ = ["BatchTrace", "KinematicRun", "covers", "is_ready", "run_batch"]
