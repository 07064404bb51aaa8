from pathlib import Path

import made_up_run
import pytest

from vergence.runtime.recording import Recording


@pytest.fixture(scope="session")
def run_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A recorded run with images; not to be changed."""
    return made_up_run.record(tmp_path_factory.mktemp("made-up"))


@pytest.fixture(scope="session")
def recording(run_folder: Path) -> Recording:
    return Recording.open(run_folder)
