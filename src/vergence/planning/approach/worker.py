"""Runs jobs of the approach while the arm moves."""

from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any, Protocol


class Worker(Protocol):
    """Runs one job at a time without delaying the loop."""

    @property
    def busy(self) -> bool:
        """Whether a job is running, or its result has not been fetched."""
        ...

    def ask(self, job: Callable[[], Any]) -> None:
        """Start a job."""
        ...

    def answer(self) -> Any:
        """Return the result of the job, once; None while there is none."""
        ...


class InlineWorker:
    """Runs each job at once, for a simulation, whose clock waits; therefore deterministic."""

    def __init__(self) -> None:
        self._answer: Any = None

    @property
    def busy(self) -> bool:
        """Whether a result has not been fetched."""
        return self._answer is not None

    def ask(self, job: Callable[[], Any]) -> None:
        """Run a job."""
        self._answer = job()

    def answer(self) -> Any:
        """Return its result, once."""
        answer, self._answer = self._answer, None
        return answer


class ThreadWorker:
    """Runs jobs in a thread of its own, for a robot, which does not wait."""

    def __init__(self) -> None:
        self._pool = ThreadPoolExecutor(1, thread_name_prefix="approach")
        self._job: Future[Any] | None = None

    @property
    def busy(self) -> bool:
        """Whether a job is running, or its result has not been fetched."""
        return self._job is not None

    def ask(self, job: Callable[[], Any]) -> None:
        """Start a job."""
        self._job = self._pool.submit(job)

    def answer(self) -> Any:
        """Return the result of the job, once; None while it is running.

        Raises:
            Exception: raised by the job.
        """
        if self._job is None or not self._job.done():
            return None
        job, self._job = self._job, None
        return job.result()
