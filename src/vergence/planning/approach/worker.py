"""Who looks again while the arm moves."""

from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any, Protocol


class Worker(Protocol):
    """Does one job at a time, which must not delay the loop."""

    @property
    def busy(self) -> bool:
        """Whether a job is under way, or its answer has not been fetched."""
        ...

    def ask(self, job: Callable[[], Any]) -> None:
        """Begin a job."""
        ...

    def answer(self) -> Any:
        """Return what came of the job, once; None while there is nothing."""
        ...


class InlineWorker:
    """Does each job at once: for a simulation, whose clock waits, and so is deterministic."""

    def __init__(self) -> None:
        self._answer: Any = None

    @property
    def busy(self) -> bool:
        """Whether an answer has not been fetched."""
        return self._answer is not None

    def ask(self, job: Callable[[], Any]) -> None:
        """Do a job."""
        self._answer = job()

    def answer(self) -> Any:
        """Return what came of it, once."""
        answer, self._answer = self._answer, None
        return answer


class ThreadWorker:
    """Does jobs in a thread of its own: for a robot, which does not wait."""

    def __init__(self) -> None:
        self._pool = ThreadPoolExecutor(1, thread_name_prefix="approach")
        self._job: Future[Any] | None = None

    @property
    def busy(self) -> bool:
        """Whether a job is under way, or its answer has not been fetched."""
        return self._job is not None

    def ask(self, job: Callable[[], Any]) -> None:
        """Begin a job."""
        self._job = self._pool.submit(job)

    def answer(self) -> Any:
        """Return what came of it, once; None while it is under way.

        Raises:
            Exception: what the job raised.
        """
        if self._job is None or not self._job.done():
            return None
        job, self._job = self._job, None
        return job.result()
