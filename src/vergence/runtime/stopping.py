"""Brings every arm to rest, whatever else has happened."""

import logging
from collections.abc import Mapping

from vergence.control import Guard
from vergence.errors import DriverSilent
from vergence.raised import raised
from vergence.runtime.driver import Driver

_LOG = logging.getLogger(__name__)
_TRIES = 3  # consecutive set-points that a driver may reject


def brake(driver: Driver, guards: Mapping[str, Guard]) -> str:
    """Brake every arm to rest within its acceleration limits.

    Args:
        driver: receives the set-points.
        guards: by arm, with the last set-points sent.

    Returns:
        Why an arm could not be braked; empty if all are at rest.
    """
    refused = 0
    while any(guard.moving for guard in guards.values()):
        rest = {name: guard.brake() for name, guard in guards.items()}
        try:
            driver.step(rest)
        except DriverSilent as silence:
            return str(silence)
        except Exception as error:
            _LOG.exception("the driver rejects set-points during braking")
            refused += 1
            if refused == _TRIES:
                return f"the driver raised {raised(error)}"
        else:
            refused = 0
    return ""
