"""Two laws from the same twenty random starts, in one table."""

import vergence as vg

STATIONARY = {"motion": {"kind": "stationary"}}

table = vg.compare(
    "ur5", ["image_based", "own"], starts=20, spread=0.5, duration_s=4, target=STATIONARY
)
print(table)
for run in table.runs:
    if run.ending != "converged":
        print(run.labels, run.ending.value, run.reason)
