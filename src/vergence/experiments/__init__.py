"""Many runs of a cell: laws from random starts, regions of targets, on all cores or a cluster."""

from vergence.experiments.campaign import run_campaign
from vergence.experiments.comparison import Comparison, compare
from vergence.experiments.evaluation import usual_tolerance_px
from vergence.experiments.executor import Executor, WorkersLostError
from vergence.experiments.goal import Goal
from vergence.experiments.kinematic import renders
from vergence.experiments.presets import OWN, PRESETS, law_table, usual_laws
from vergence.experiments.region import heading_trials, place_trials
from vergence.experiments.results_file import RESULTS, ResultsFile
from vergence.experiments.run_trial import run_trial, run_trials
from vergence.experiments.sampling import Sampling
from vergence.experiments.score import Score, scores
from vergence.experiments.source import CellSource
from vergence.experiments.starts import start_trials
from vergence.experiments.trial import Ending, Trial, TrialResult

__all__ = [
    "Goal",
    "CellSource",
    "Comparison",
    "Executor",
    "Sampling",
    "Ending",
    "ResultsFile",
    "OWN",
    "PRESETS",
    "RESULTS",
    "Score",
    "Trial",
    "TrialResult",
    "WorkersLostError",
    "compare",
    "heading_trials",
    "law_table",
    "place_trials",
    "renders",
    "run_campaign",
    "run_trial",
    "run_trials",
    "scores",
    "start_trials",
    "usual_laws",
    "usual_tolerance_px",
]
