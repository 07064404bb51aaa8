import numpy as np
import pytest
from estimation_scene import HAND, WALL, moving, pose_error, view

from vergence.estimation import FilterHistory, PoseFilter, Verdict


def images(rng, seconds=1.0):
    """Two cameras of 26 and 40 Hz, not in step, with some wrong matches."""
    views = [view(rng, k / 26, moving(k / 26), WALL, "wall", outliers=0.1) for k in range(1, 27)]
    views += [
        view(rng, k / 40, moving(k / 40), HAND, "hand", outliers=0.1)
        for k in range(1, int(40 * seconds))
    ]
    return sorted(views, key=lambda v: (v.time, v.camera))


def fed(views, horizon=0.5):
    filter_ = PoseFilter()
    history = FilterHistory(filter_, filter_.start(0.0, moving(0.0)), horizon)
    verdicts = []
    for image in views:
        history, update = history.add(image)
        verdicts.append(update.verdict)
    return history, verdicts


def test_arrival_order_does_not_change_the_belief():
    views = images(np.random.default_rng(1))
    ordered, _ = fed(views)
    late = sorted(views, key=lambda v: v.time + (0.15 if v.camera == "hand" else 0.02))
    assert [v.time for v in late] != [v.time for v in views]
    delayed, verdicts = fed(late)
    np.testing.assert_array_equal(
        delayed.belief.T_world_target, ordered.belief.T_world_target, strict=True
    )
    np.testing.assert_array_equal(delayed.belief.covariance, ordered.belief.covariance)
    assert delayed.belief is delayed.entries[-1].after
    assert Verdict.TOO_LATE not in verdicts


def test_shuffled_arrival_gives_the_same_belief():
    rng = np.random.default_rng(2)
    views = images(rng, seconds=0.4)[:20]
    ordered, _ = fed(views)
    for _ in range(3):
        shuffled, _ = fed([views[i] for i in rng.permutation(len(views))])
        np.testing.assert_array_equal(shuffled.belief.T_world_target, ordered.belief.T_world_target)


def test_late_image_counts_at_its_exposure():
    # Used at its arrival instead, 0.2 s of motion would be taken for noise.
    rng = np.random.default_rng(3)
    filter_ = PoseFilter()
    views = [view(rng, k / 26, moving(k / 26, 2.0), HAND, "hand") for k in range(40)]
    history = FilterHistory(filter_, filter_.start(-0.01, moving(0.0)))
    wrong = filter_.start(-0.01, moving(0.0))
    for k, image in enumerate(views):
        history, _ = history.add(image)
        wrong = filter_.update(wrong, image._replace(time=image.time + 0.2)).belief
        now = image.time + 0.2
        if k > 20:
            truth = moving(now, 2.0)
            honest = pose_error(history.at(now).T_world_target, truth)
            late = pose_error(wrong.T_world_target, truth)
            assert np.linalg.norm(honest[:3]) < 0.5 * np.linalg.norm(late[:3])


def test_same_image_twice_counts_once():
    views = images(np.random.default_rng(4))[:10]
    once, _ = fed(views)
    twice, verdicts = fed([*views, views[-1], views[3]])
    assert verdicts[-2:] == [Verdict.REPEATED, Verdict.REPEATED]
    np.testing.assert_array_equal(twice.belief.covariance, once.belief.covariance)


def test_image_older_than_the_horizon_is_refused_and_harmless():
    views = images(np.random.default_rng(5))
    history, _ = fed(views[1:], horizon=0.2)
    again, update = history.add(views[0])
    assert update.verdict is Verdict.TOO_LATE
    assert again is history
    assert len(history.entries) < 0.2 * 70 + 3


def test_past_is_asked_from_the_images_until_then():
    views = images(np.random.default_rng(6))
    history, _ = fed(views)
    early, _ = fed([v for v in views if v.time <= 0.8])
    for time in (0.8, 0.805):
        np.testing.assert_array_equal(
            history.at(time).T_world_target, early.at(time).T_world_target
        )


def in_step(rng, ticks=12):
    """Two cameras that expose together, with some wrong matches."""
    return [
        view(rng, k / 26, moving(k / 26), pose, name, outliers=0.1)
        for k in range(1, ticks + 1)
        for name, pose in (("hand", HAND), ("wall", WALL))
    ]


class Counting(PoseFilter):
    """Notes how many points each update took in."""

    sizes: list = []  # noqa: RUF012

    def update(self, belief, seen):
        self.sizes.append(seen.size)
        return super().update(belief, seen)


def test_images_of_one_exposure_are_one_update():
    views = in_step(np.random.default_rng(7), ticks=3)
    filter_ = Counting()
    filter_.sizes.clear()
    history = FilterHistory(filter_, filter_.start(0.0, moving(0.0)))
    history, updates = history.add_all(views)
    assert filter_.sizes == [2 * len(views[0].points)] * 3
    assert [len(u.kept) for u in updates] == [v.size for v in views]
    assert len(history.entries) == 3


def test_together_or_one_after_the_other_or_late_the_belief_is_the_same_to_the_bit():
    rng = np.random.default_rng(8)
    views = in_step(rng)
    singly, _ = fed(views)
    shuffled, _ = fed([views[i] for i in rng.permutation(len(views))])
    filter_ = PoseFilter()
    together = FilterHistory(filter_, filter_.start(0.0, moving(0.0)))
    for k in range(0, len(views), 2):
        together, _ = together.add_all(views[k : k + 2][::-1])
    for other in (singly, shuffled):
        np.testing.assert_array_equal(other.belief.covariance, together.belief.covariance)
        np.testing.assert_array_equal(other.belief.T_world_target, together.belief.T_world_target)
        assert other.belief.consistency == together.belief.consistency


def test_camera_that_contradicts_all_others_is_told_apart():
    rng = np.random.default_rng(9)
    right = [view(rng, 0.1, moving(0.1), pose, name) for name, pose in (("a", HAND), ("b", WALL))]
    wrong = view(rng, 0.1, moving(0.1), WALL, "c", features=[0, 3, 6])
    wrong = wrong._replace(measured=wrong.measured + 0.2)
    filter_ = PoseFilter()
    history = FilterHistory(filter_, filter_.start(0.0, moving(0.0)))
    history, updates = history.add_all([wrong, *right])
    assert [u.verdict for u in updates] == [Verdict.CONTRADICTED, Verdict.USED, Verdict.USED]
    assert history.belief.doubts == 0
    alone, _ = FilterHistory(filter_, filter_.start(0.0, moving(0.0))).add_all(right)
    assert pose_error(history.belief.T_world_target, alone.belief.T_world_target) == pytest.approx(
        np.zeros(6), abs=1e-12
    )


def test_image_twice_at_once_counts_once():
    image = view(np.random.default_rng(10), 0.1, moving(0.1))
    filter_ = PoseFilter()
    start = FilterHistory(filter_, filter_.start(0.0, moving(0.0)))
    twice, updates = start.add_all([image, image])
    once, _ = start.add(image)
    assert [u.verdict for u in updates] == [Verdict.USED, Verdict.REPEATED]
    np.testing.assert_array_equal(twice.belief.covariance, once.belief.covariance)
