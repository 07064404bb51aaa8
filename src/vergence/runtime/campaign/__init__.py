"""Many runs of a cell: laws from random starts, regions of targets, on all cores or a cluster."""

from vergence.runtime.campaign.aim import Aim
from vergence.runtime.campaign.campaign import run_campaign
from vergence.runtime.campaign.crew import Crew, WorkersLostError
from vergence.runtime.campaign.draws import Draws
from vergence.runtime.campaign.ledger import RESULTS, Ledger
from vergence.runtime.campaign.presets import OWN, PRESETS, law_table, usual_laws
from vergence.runtime.campaign.region import heading_trials, place_trials
from vergence.runtime.campaign.run_trial import run_trial, run_trials
from vergence.runtime.campaign.score import Score, scores
from vergence.runtime.campaign.source import CellSource
from vergence.runtime.campaign.starts import start_trials
from vergence.runtime.campaign.trace import TrialTrace
from vergence.runtime.campaign.trial import Ending, Trial, TrialResult

__all__ = [
    "Aim",
    "CellSource",
    "Crew",
    "Draws",
    "Ending",
    "Ledger",
    "OWN",
    "PRESETS",
    "RESULTS",
    "Score",
    "Trial",
    "TrialResult",
    "TrialTrace",
    "WorkersLostError",
    "heading_trials",
    "law_table",
    "place_trials",
    "run_campaign",
    "run_trial",
    "run_trials",
    "scores",
    "start_trials",
    "usual_laws",
]
