"""Solvers: compute joint rates from a quadratic in the twist of the arm's tip."""

from vergence.control.solvers._redundancy import resolve_redundant
from vergence.control.solvers.pseudo_inverse import (
    DampedPseudoInverse,
    PseudoInverse,
    singular_fault,
)
from vergence.control.solvers.quadratic_program import QuadraticProgram
from vergence.control.solvers.solver import (
    BoundSolver,
    Obstacles,
    Pressure,
    Problem,
    Setting,
    Solution,
    Solver,
    describe,
)

__all__ = [
    "BoundSolver",
    "DampedPseudoInverse",
    "Obstacles",
    "Pressure",
    "Problem",
    "PseudoInverse",
    "QuadraticProgram",
    "Setting",
    "Solution",
    "Solver",
    "describe",
    "resolve_redundant",
    "singular_fault",
]
