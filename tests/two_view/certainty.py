"""Counts two-view answers that are wrong and certain, over random scenes of every kind.

    python tests/two_view/certainty.py 2000

A scene is wrong if no motion of the answer, alternatives included, lies within five standard
deviations of the truth in rotation and direction of translation; in a scene without a common
motion every answer is wrong.
"""

import sys
from collections import Counter
from pathlib import Path

import numpy as np

sys.path.append(str(Path(__file__).parent))
from two_view_scenes import CAMERA

from vergence.arrays import FloatArray
from vergence.geometry import se3, se3_inverse, so3_exp, so3_log, transform_points
from vergence.vision.two_view import TwoView, TwoViewFailure, estimate_two_view

BEYOND = 5.0  # standard deviations
KINDS = ("flat", "nearly flat", "general", "unrelated")


def scene(
    random: np.random.Generator, kind: str
) -> tuple[FloatArray, FloatArray, FloatArray, float]:
    """Return current and desired points (N, 2), the true T_star_camera, and the stated noise."""
    count = int(random.choice([4, 5, 6, 7, 8, 9, 12, 20, 40, 80]))
    if kind == "unrelated":
        size = (CAMERA.width, CAMERA.height)
        return *random.uniform(0, size, (2, count, 2)), np.full((4, 4), np.nan), 0.5
    depth = {"flat": 0.0, "nearly flat": 10.0 ** random.uniform(-4, -1.5), "general": 0.15}[kind]
    tilt = so3_exp(random.normal(size=3) * 0.4)
    points = (random.uniform(-1, 1, (count, 3)) * [0.2, 0.2, depth]) @ tilt.T + [0, 0, 1.0]
    # The camera turns and moves around the object, which stays about in the middle.
    angle = np.deg2rad(random.choice([3.0, 10.0, 25.0]))
    axis = random.normal(size=3)
    R = so3_exp(axis / np.linalg.norm(axis) * angle) @ so3_exp(
        np.array([0.0, 0.0, 0.5 * random.normal()])
    )
    place = np.array([0, 0, 1.0]) - R @ [0, 0, random.uniform(0.8, 1.2)]
    T_star_camera = se3(R, place + random.normal(size=3) * 0.02)
    now = transform_points(se3_inverse(T_star_camera), points)
    stated = 0.5
    true_noise = stated * random.choice([0.5, 1.0, 1.5])
    current, desired = CAMERA.project(now), CAMERA.project(points)
    current = current + true_noise * random.normal(size=current.shape)
    desired = desired + true_noise * random.normal(size=desired.shape)
    wrong = int(random.choice([0.0, 0.2, 0.4]) * count)
    current[count - wrong :] = random.uniform(0, (CAMERA.width, CAMERA.height), (wrong, 2))
    return current, desired, T_star_camera, stated


def deviations(view: TwoView, T_star_camera: FloatArray) -> float:
    """Return by how many standard deviations a motion misses the truth.

    It is the larger of two ratios, each to the largest deviation stated of its kind: of the angle
    between the rotations, and between the directions of translation.
    """
    turn = so3_log(np.ascontiguousarray(T_star_camera[:3, :3] @ view.rotation.T))
    t, truth, C = view.translation, T_star_camera[:3, 3], view.covariance
    across = np.linalg.svd(t[None])[2][1:]
    cosine = t @ truth / np.linalg.norm(t) / np.linalg.norm(truth)
    aim = np.arccos(np.clip(cosine, -1.0, 1.0))
    turn_deviation = np.sqrt(np.linalg.eigvalsh(C[3:, 3:])[-1])
    aim_deviation = np.sqrt(np.linalg.eigvalsh(across @ C[:3, :3] @ across.T)[-1])
    return float(
        max(np.linalg.norm(turn) / turn_deviation, aim / aim_deviation * np.linalg.norm(t))
    )


def judge(answer: TwoView | TwoViewFailure, T_star_camera: FloatArray) -> str:
    """Return "right", "ambiguous", "refused" or "wrong"."""
    if not isinstance(answer, TwoView):
        return "refused"
    motions = (answer, *answer.alternatives)
    if np.isnan(T_star_camera[0, 0]):
        return "wrong"
    if min(deviations(motion, T_star_camera) for motion in motions) > BEYOND:
        return "wrong"
    return "ambiguous" if answer.ambiguous else "right"


def count_answers(scenes: int, seed: int = 0) -> dict[str, Counter[str]]:
    """Return how often each kind of scene had each kind of answer."""
    counts = {kind: Counter[str]() for kind in KINDS}
    for number in range(scenes):
        random = np.random.default_rng([seed, number])
        kind = KINDS[number % len(KINDS)]
        current, desired, truth, noise = scene(random, kind)
        answer = estimate_two_view(current, desired, CAMERA, noise_px=noise)
        counts[kind][judge(answer, truth)] += 1
    return counts


if __name__ == "__main__":
    asked = int(sys.argv[1]) if len(sys.argv) > 1 else 1000
    total = Counter[str]()
    for kind, counts in count_answers(asked).items():
        sys.stdout.write(f"{kind:12s} {dict(sorted(counts.items()))}\n")
        total += counts
    sys.stdout.write(f"{'all':12s} {dict(sorted(total.items()))}\n")
