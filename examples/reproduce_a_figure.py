"""Repeat a paper's experiments on exact projections, and keep one of its figures."""

import vergence as vg

study = vg.reproduce("nelson1995", quick=True, seed=3)
study.figure(8).savefig("figure_8.svg")
for check in study.checks:
    print("holds" if check.holds else "fails", check.name, f"{check.measured:.3g}", check.unit)
