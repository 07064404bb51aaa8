"""Kernels that came with the wheel are used where they run, and nowhere else."""

import json
import os
import sys
from importlib.metadata import version
from pathlib import Path

import pytest

from vergence.kernels import prebuilt

HERE = {
    "python": f"{sys.version_info.major}.{sys.version_info.minor}",
    "numba": version("numba"),
    "processor": "x86-64-v3",
    "needs": [],
}


@pytest.fixture
def described(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Where the wheel would say what it carries; the environment is put back afterwards."""
    for name in ("NUMBA_CPU_NAME", "NUMBA_CPU_FEATURES"):
        monkeypatch.setenv(name, "set, so that it is restored")
        monkeypatch.delenv(name)
    monkeypatch.delenv(prebuilt.SWITCH, raising=False)
    # numba itself is left as it is: other tests go on in this process
    monkeypatch.setattr(sys, "modules", {k: v for k, v in sys.modules.items() if k != "numba"})
    path = tmp_path / "kernels.json"
    monkeypatch.setattr(prebuilt, "_DESCRIBED", path)
    return path


def test_a_checkout_compiles_for_its_own_processor(described: Path) -> None:
    assert prebuilt.use_prebuilt_kernels() == ""
    assert "NUMBA_CPU_NAME" not in os.environ


def test_kernels_that_run_here_are_asked_for(described: Path) -> None:
    described.write_text(json.dumps(HERE))
    assert prebuilt.use_prebuilt_kernels() == ""
    assert os.environ["NUMBA_CPU_NAME"] == "x86-64-v3"
    assert os.environ["NUMBA_CPU_FEATURES"] == ""


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"numba": "0.1"}, "numba 0.1"),
        ({"python": "3.2"}, "python 3.2"),
        ({"needs": ["third_eye"]}, "processors with third_eye"),
    ],
)
def test_kernels_for_something_else_are_left_with_a_reason(
    described: Path, change: dict[str, object], reason: str
) -> None:
    described.write_text(json.dumps(HERE | change))
    assert reason in prebuilt.use_prebuilt_kernels()
    assert "NUMBA_CPU_NAME" not in os.environ


def test_a_variable_switches_them_off(described: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    described.write_text(json.dumps(HERE))
    monkeypatch.setenv(prebuilt.SWITCH, "native")
    assert prebuilt.SWITCH in prebuilt.use_prebuilt_kernels()
    assert "NUMBA_CPU_NAME" not in os.environ
