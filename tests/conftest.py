"""What holds for every test."""

import gc
import signal
from collections.abc import Iterator

import pytest

# Tests press Ctrl-C on commands of their own, and hang up. In a shell's background SIGINT is
# ignored, and under nohup SIGHUP; what is started there would inherit that.
if signal.getsignal(signal.SIGHUP) is signal.SIG_IGN:
    signal.signal(signal.SIGHUP, signal.SIG_DFL)
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture(autouse=True)
def garbage_is_collected() -> Iterator[None]:
    """The command line collects seldom, since its process ends soon; that of tests does not."""
    before = gc.get_threshold()
    yield
    gc.set_threshold(*before)
