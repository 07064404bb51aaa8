"""Who runs the trials: this process, processes of this machine, or a cluster."""

import logging
import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from importlib import import_module
from typing import Any

from vergence.errors import InputError
from vergence.runtime.campaign.run_trial import run_trial
from vergence.runtime.campaign.source import CellSource
from vergence.runtime.campaign.trial import Trial, TrialResult

_CONNECT_S = 10
_SCHEDULER = "a Dask scheduler, such as tcp://10.0.0.1:8786"


@dataclass(frozen=True, slots=True)
class Crew:
    """How many processes of this machine, or which scheduler's workers."""

    workers: int | None = None  # every core's if None; 1 is this process
    scheduler: str | None = None  # address of a Dask scheduler, such as tcp://10.0.0.1:8786

    def run(
        self, source: CellSource, trials: Sequence[Trial], tolerance_px: float
    ) -> Iterator[TrialResult]:
        """Yield results as they come, in any order.

        Trials of a worker that dies are given to another.

        Raises:
            InputError: if there is no scheduler at the address.
        """
        count = self.workers or os.cpu_count() or 1
        if self.scheduler is None and min(count, len(trials)) <= 1:
            for trial in trials:
                yield run_trial(source, trial, tolerance_px)
            return
        distributed: Any = import_module("distributed")
        with self._client(min(count, len(trials))) as client:
            futures = client.map(
                run_trial, [source] * len(trials), trials, [tolerance_px] * len(trials), pure=False
            )
            for future in distributed.as_completed(futures):
                yield future.result()

    @contextmanager
    def _client(self, count: int) -> Iterator[Any]:
        distributed: Any = import_module("distributed")
        if self.scheduler is not None:
            try:
                client = distributed.Client(self.scheduler, timeout=_CONNECT_S)
            except (OSError, TimeoutError, ValueError) as error:
                allowed = "the address of a Dask scheduler, such as tcp://10.0.0.1:8786"
                raise InputError(
                    "--scheduler", "", f"{self.scheduler} ({error})", allowed
                ) from None
            with client:
                yield client
            return
        with (
            distributed.LocalCluster(
                n_workers=count,
                threads_per_worker=1,
                processes=True,
                dashboard_address=None,
                silence_logs=logging.ERROR,
            ) as cluster,
            distributed.Client(cluster) as client,
        ):
            yield client
