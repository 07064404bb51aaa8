"""Thousands of ideal runs at once: the loop as a kernel, and the loop itself beside it."""

from vergence.experiments.batch.ideal_run import IdealRun
from vergence.experiments.batch.run_batch import BatchTrace, covers, run_batch

__all__ = ["BatchTrace", "IdealRun", "covers", "run_batch"]
