import numpy as np
import pytest
from scipy.stats import chi2, norm

from vergence.estimation import Consistency
from vergence.geometry.chi_square import chi_square_quantile


@pytest.mark.parametrize("freedom", [2, 6, 16, 100, 1000])
def test_quantile_is_near_the_exact_one(freedom):
    for z in (1.0, 2.0, 3.09):
        exact = chi2.ppf(norm.cdf(z), freedom)
        assert chi_square_quantile(freedom, z) == pytest.approx(exact, rel=0.03)


def test_nothing_seen_yet_is_consistent():
    assert Consistency().holds
    assert Consistency().ratio == Consistency().scale == 1.0


def test_honest_innovations_are_rarely_called_inconsistent():
    rng = np.random.default_rng(1)
    wrong = 0
    for _ in range(40):
        sums = Consistency()
        for _ in range(100):
            sums = sums.add(rng.chisquare(8), 8, 0.9)
            wrong += not sums.holds
    assert wrong < 0.005 * 4000


def test_innovations_twice_too_large_are_noticed_within_ten_images_and_forgotten_after():
    rng = np.random.default_rng(2)
    sums = Consistency()
    for _ in range(10):
        sums = sums.add(2.0 * rng.chisquare(16), 16, 0.9)
    assert not sums.holds
    assert sums.scale == sums.ratio == pytest.approx(2.0, rel=0.25)
    for _ in range(40):
        sums = sums.add(rng.chisquare(16), 16, 0.9)
    assert sums.holds
    assert sums.scale == 1.0
