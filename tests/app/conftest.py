from collections.abc import Iterator
from pathlib import Path

import made_up_run
import pytest

from vergence.app import heartbeat
from vergence.runtime.recording import Recording


@pytest.fixture(autouse=True)
def no_heartbeat(monkeypatch: pytest.MonkeyPatch) -> None:
    """On a slow computer a command says how far it is; tests of messages want only those."""
    monkeypatch.setattr(heartbeat, "FIRST_S", 600.0)


@pytest.fixture(scope="session", autouse=True)
def own_cache(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Commands note how long they took; those of tests do so in a folder of their own."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CACHE_HOME", str(tmp_path_factory.mktemp("cache")))
        yield


@pytest.fixture(scope="session")
def run_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A recorded run with images; not to be changed."""
    return made_up_run.record(tmp_path_factory.mktemp("made-up"))


@pytest.fixture(scope="session")
def recording(run_folder: Path) -> Recording:
    return Recording.open(run_folder)
