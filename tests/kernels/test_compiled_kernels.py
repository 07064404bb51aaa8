"""Whether a kernel needs compilation is known before it is called."""

import importlib.util
import sys
from pathlib import Path

import numpy as np
import pytest

from vergence.kernels.compiled import is_compiled

KERNEL = """
from numba import njit

@njit(cache=True)
def total(values, share):
    return share * values.sum()
"""


def loaded(path: Path):
    """Load the kernel's module as another process would."""
    spec = importlib.util.spec_from_file_location("a_kernel", path)
    module = importlib.util.module_from_spec(spec)
    sys.modules["a_kernel"] = module
    spec.loader.exec_module(module)
    return module.total


@pytest.fixture
def path(tmp_path: Path) -> Path:
    file = tmp_path / "a_kernel.py"
    file.write_text(KERNEL)
    return file


def test_a_kernel_is_compiled_for_the_types_that_it_was_called_with(path: Path) -> None:
    total = loaded(path)
    assert not is_compiled(total, np.ones(3), 2.0)
    assert total(np.ones(3), 2.0) == 6.0
    assert is_compiled(total, np.zeros(5), 1.0)
    assert not is_compiled(total, np.ones((3, 3)), 2.0)


def test_a_kernel_is_compiled_if_an_earlier_process_kept_it(path: Path) -> None:
    loaded(path)(np.ones(3), 2.0)
    again = loaded(path)
    assert not again.overloads
    assert is_compiled(again, np.ones(3), 2.0)
    path.write_text(KERNEL.replace("share *", "2.0 * share *"))
    assert not is_compiled(loaded(path), np.ones(3), 2.0)
