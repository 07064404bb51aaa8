"""Bringing every arm to rest, whatever else has happened."""

import logging
from collections.abc import Mapping

from vergence.control import Guard
from vergence.errors import DriverSilent
from vergence.runtime.driver import Driver

_LOG = logging.getLogger(__name__)
_TRIES = 3  # set-points that a driver may refuse one after the other


def brake(driver: Driver, guards: Mapping[str, Guard]) -> str:
    """Brake every arm to rest within its acceleration limits.

    Args:
        driver: takes the set-points.
        guards: by arm, with the set-points that were handed over last.

    Returns:
        Why an arm could not be braked from here; empty if all are at rest.
    """
    refused = 0
    while any(guard.moving for guard in guards.values()):
        rest = {name: guard.brake() for name, guard in guards.items()}
        try:
            driver.step(rest)
        except DriverSilent as silence:
            return str(silence)
        except Exception as error:
            _LOG.exception("the driver refuses set-points while it is braked")
            refused += 1
            if refused == _TRIES:
                return raised("driver", error)
        else:
            refused = 0
    return ""


def raised(part: str, error: BaseException) -> str:
    """Return in one sentence what a part raised."""
    first = next(iter(str(error).splitlines()), "")
    text = f"{type(error).__name__}: {first}" if first else type(error).__name__
    return f"the {part} raised {text[:200]}"
