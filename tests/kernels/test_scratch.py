"""Arrays on the stack of a kernel."""

import numpy as np
from numba import njit

from vergence.kernels.scratch import scratch


@njit
def product(A, B):  # type: ignore[no-untyped-def]
    left, right = scratch(2, 3), scratch(3, 4)
    total = np.zeros((2, 4))
    for turn in range(2):  # the same two arrays again
        left[:] = A + turn
        right[:] = B
        for i in range(left.shape[0]):
            for j in range(right.shape[1]):
                for k in range(left.shape[1]):
                    total[i, j] += left[i, k] * right.T[j, k]
    return total


def test_scratch_arrays_have_their_shape_and_do_not_overlap() -> None:
    rng = np.random.default_rng(0)
    A, B = rng.standard_normal((2, 3)), rng.standard_normal((3, 4))
    np.testing.assert_allclose(product(A, B), (2.0 * A + 1.0) @ B, rtol=1e-12)
