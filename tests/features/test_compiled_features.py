"""Features by number in kernels, against the classes."""

import numpy as np
import pytest

from vergence.features import Feature
from vergence.features.compiled_features import (
    COMPILED_FEATURES,
    feature_drift,
    feature_interaction,
    feature_value,
)


@pytest.mark.parametrize(("kind", "number"), COMPILED_FEATURES.items())
def test_a_feature_is_in_a_kernel_what_its_class_says(kind: type[Feature], number: int) -> None:
    rng = np.random.default_rng(0)
    for count in (1, 2, 7):
        points, depth_m = rng.normal(0.0, 0.3, (count, 2)), rng.uniform(0.2, 3.0, count)
        flow = rng.normal(0.0, 0.5, (count, 2))
        feature = kind(points, depth_m)
        np.testing.assert_allclose(feature_value(number, points, depth_m), feature.value())
        L = feature_interaction(number, points, depth_m)
        np.testing.assert_allclose(L, feature.interaction(), atol=1e-14)
        np.testing.assert_allclose(feature_drift(number, flow), feature.drift(flow), atol=1e-9)
