"""[Lippiello2005] section V: any cameras, one pose; and what the method does beyond the paper."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from vergence.arrays import FloatArray
from vergence.cell import Cell, load_cell
from vergence.studies import lippiello2005_figures as figures
from vergence.studies.check import Check, Progress, StudyResult, within
from vergence.studies.lippiello2005_cost import BUDGET, Cost, measure_costs
from vergence.studies.lippiello2005_trials import (
    BLIND_S,
    FIXED,
    PAPER,
    Trial,
    blinded,
    passes,
    past_singular_pitch,
    run,
    slowed,
)

TITLE = "Lippiello, Siciliano and Villani (2005): eye-in-hand and eye-to-hand cameras together"
NOISE_PX = 1.0  # of the exact projections of a quick study


def reproduce(
    out: Path, quick: bool, progress: Progress = lambda _what, _share: None, seed: int = 0
) -> StudyResult:
    """Run section V and what follows from it; write the figures.

    Args:
        out: folder for the figures.
        quick: exact projections with noise instead of rendered images.
        progress: told what is being done.
        seed: of the cell.
    """
    cell = load_cell("lippiello2005", seed=seed)
    if quick:
        cell = cell.replace(perception={"noise_px": NOISE_PX})
    images = not quick
    trials = {}
    for k, (name, variant) in enumerate(variants(cell).items()):
        progress(name.replace("_", " "), 0.085 * k)
        trials[name] = run(variant, images)
    progress("singular pitch", 0.78)
    pitch = {
        name: past_singular_pitch(variant, images)
        for name, variant in (("ours", cell), ("paper", cell.replace(**PAPER)))
    }
    progress("cost", 0.9)
    checks = [
        *_estimation(trials),
        *_speed(cell, trials),
        *_slave(trials),
        _view_loss(trials),
        _outliers(trials),
        _singular_pitch(pitch),
        _four_features(trials),
        *_cost(*measure_costs(cell, (2, 64))),
    ]
    progress("figures", 0.97)
    return StudyResult(TITLE, tuple(checks), figures.draw(out, trials), seed)


def variants(cell: Cell) -> Mapping[str, Cell]:
    """Return the cells to run, by name."""
    paper = cell.replace(**PAPER)
    # Four features are for following: a start known well, since they are too few to find it by.
    four = {"budget": 4, "start_error_m": 0.002, "start_error_deg": 0.3}
    return {
        "hybrid": paper,
        "fixed": paper.replace(**FIXED),
        "hybrid_slow": slowed(paper, 0.5),
        "fixed_slow": slowed(paper.replace(**FIXED), 0.5),
        "ours": cell,
        "blinded": blinded(cell),
        "outliers": cell.replace(perception={"outliers": 0.2}),
        "four_information": cell.replace(perception=four),
        "four_indexes": cell.replace(perception={**four, "selection": "indexes"}),
    }


Trials = Mapping[str, Trial]


def _estimation(trials: Trials) -> list[Check]:
    hybrid, fixed, ours = trials["hybrid"], trials["fixed"], trials["ours"]
    position, angle = hybrid.position().max(), hybrid.orientation_deg().max()
    ratio_m = _rms(fixed.position()) / _rms(hybrid.position())
    ratio_deg = _rms(fixed.orientation_deg()) / _rms(hybrid.orientation_deg())
    return [
        Check(
            "hybrid.position_error_max_m",
            "below 0.01 (Fig. 6)",
            position,
            "m",
            hybrid.outcome.succeeded and within(position, 0.0, 0.01),
            f"the paper's state, Q and R; error-state filter: {ours.position().max():.2g}",
        ),
        Check(
            "hybrid.orientation_error_max_deg",
            "below 3 (Fig. 6)",
            angle,
            "deg",
            hybrid.outcome.succeeded and within(angle, 0.0, 3.0),
            f"error-state filter: {ours.orientation_deg().max():.2g}",
        ),
        Check(
            "fixed.position_error_ratio",
            "sensibly higher (Fig. 8): at least 1.5",
            ratio_m,
            "",
            within(ratio_m, 1.5),
            f"root mean squares; largest with the fixed camera {fixed.position().max():.2g} m",
        ),
        Check(
            "fixed.orientation_error_ratio",
            "sensibly higher (Fig. 8): at least 1.5",
            ratio_deg,
            "",
            within(ratio_deg, 1.5),
            f"root mean squares; largest {fixed.orientation_deg().max():.2g} degrees",
        ),
    ]


def _speed(cell: Cell, trials: Trials) -> list[Check]:
    """Compare the fast pass, and the slow one at half its speed: twice and half the slow pass."""
    twice, half = passes(cell)[1], passes(slowed(cell, 0.5))[0]
    ratios = {}
    for name in ("fixed", "hybrid"):
        fast, slow = trials[name], trials[f"{name}_slow"]
        ratios[name] = (
            _rms(fast.position(*twice)) / _rms(slow.position(*half)),
            _rms(fast.orientation_deg(*twice)) / _rms(slow.orientation_deg(*half)),
        )
    smaller = ratios["hybrid"][0] < ratios["fixed"][0]
    return [
        Check(
            f"{name}.speed_sensitivity",
            said,
            ratios[name][0],
            "",
            smaller,
            f"position error at twice over half the speed; orientation {ratios[name][1]:.2g}",
        )
        for name, said in (
            ("fixed", "quite sensible to the velocity of the object"),
            ("hybrid", "not significantly influenced: smaller than the fixed camera's"),
        )
    ]


def _slave(trials: Trials) -> list[Check]:
    ours, paper = trials["ours"], trials["hybrid"]
    position, angle = ours.pose_m().max(), ours.pose_deg().max()
    paper_m, paper_deg = paper.pose_m().max(), paper.pose_deg().max()
    delayed = "higher than the estimation error, because of the delay (Fig. 7)"
    return [
        Check(
            "slave.position_error_max_m",
            "aim at 0.017",
            position,
            "m",
            within(position, 0.0, 0.017),
            "error-state filter, feed-forward, prediction over the latency",
        ),
        Check(
            "slave.orientation_error_max_deg",
            "aim at 2.5",
            angle,
            "deg",
            within(angle, 0.0, 2.5),
        ),
        Check(
            "slave.paper_position_error_max_m",
            f"{delayed}; aim at 0.017",
            paper_m,
            "m",
            paper_m > paper.position().max() and within(paper_m, 0.0, 0.017),
            "the paper's settings",
        ),
        Check(
            "slave.paper_orientation_error_max_deg",
            f"{delayed}; aim at 2.5",
            paper_deg,
            "deg",
            paper_deg > paper.orientation_deg().max() and within(paper_deg, 0.0, 2.5),
            "the paper's settings",
        ),
    ]


def _view_loss(trials: Trials) -> Check:
    blind, seeing = trials["blinded"], trials["ours"]
    recovered = 0
    notes = []
    for name, (start, end) in BLIND_S.items():
        after = _rms(blind.position(end + 0.5, end + 2.0))
        usual = _rms(seeing.position(end + 0.5, end + 2.0))
        worst = float(blind.position(start, end).max(initial=0.0))
        recovered += int(after < 1.5 * usual + 1e-4 and not blind.diverged)
        notes.append(f"{name} blind: at most {worst:.2g} m, then {after:.2g} m (else {usual:.2g})")
    return Check(
        "view_loss.recovered",
        "of 2: each camera blind for 4 s, the error afterwards as before",
        recovered,
        "",
        recovered == len(BLIND_S),
        "; ".join(notes),
    )


def _outliers(trials: Trials) -> Check:
    trial = trials["outliers"]
    worst = trial.position().max()
    return Check(
        "outliers.position_error_max_m",
        "20 % wrong matches: below 0.005",
        worst,
        "m",
        trial.outcome.succeeded and within(worst, 0.0, 0.005),
    )


def _singular_pitch(errors: Mapping[str, FloatArray]) -> Check:
    ours, paper = (float(errors[name].max()) for name in ("ours", "paper"))
    return Check(
        "singular_pitch.orientation_error_max_deg",
        "10 degrees beside pitch 90: below 4, where roll-pitch-yaw is not",
        ours,
        "deg",
        ours < 4.0 < paper,
        f"roll-pitch-yaw state: {paper:.3g}",
    )


def _four_features(trials: Trials) -> Check:
    held, other = trials["four_information"], trials["four_indexes"]
    ends = f"{'diverged' if other.diverged else 'held'}, {other.position().max():.2g} m"
    return Check(
        "four_features.diverged",
        "0: chosen by information, four features hold",
        float(held.diverged),
        "",
        not held.diverged,
        f"at most {held.position().max():.2g} m; the indexes {ends}",
    )


def _cost(few: Cost, many: Cost) -> list[Check]:
    def times(part: str) -> str:
        spent = f"{1e6 * getattr(many, part):.0f} over {1e6 * getattr(few, part):.0f} µs"
        return f"64 cameras over 2, {BUDGET} features: {spent}"

    return [
        Check(
            f"cost.{part}_ratio",
            said,
            getattr(many, part) / getattr(few, part),
            "",
            part == "total" or within(getattr(many, part) / getattr(few, part), 0.0, 1.5),
            times(part),
        )
        for part, said in (
            ("update", "independent of the number of cameras: at most 1.5"),
            ("extraction", "independent of the number of cameras: at most 1.5"),
            ("total", "not claimed: visibility and choice grow with the cameras"),
        )
    ]


def _rms(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(np.square(values))))
