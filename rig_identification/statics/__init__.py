"""Chapter 2 of the thesis: bodies at rest on n cables, and where their centre of mass is."""

from rig_identification.statics.center_of_mass import solve_center_of_mass
from rig_identification.statics.equilibrium import Equilibrium, EquilibriumSearch, find_equilibria
from rig_identification.statics.observation import StaticObservation, observe_equilibrium, observe_static
from rig_identification.statics.static_solution import StaticPose, StaticSolution, without_frame

__all__ = [
    "Equilibrium",
    "EquilibriumSearch",
    "StaticObservation",
    "StaticPose",
    "StaticSolution",
    "find_equilibria",
    "observe_equilibrium",
    "observe_static",
    "solve_center_of_mass",
    "without_frame",
]
