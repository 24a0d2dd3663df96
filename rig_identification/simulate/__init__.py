"""Simulator: the estimator's own forward model, with sensors, noise and a rig not quite as described."""

from rig_identification.simulate.exciter import Multisine, UnbalancedMass
from rig_identification.simulate.session import Truth, simulate_session
from rig_identification.simulate.spec import RunSpec, SampleRates, SessionSpec, StaticSpec
from rig_identification.simulate.start import AtRest, Displaced, Posed, Pulled
from rig_identification.simulate.thesis_case import case_spec

__all__ = [
    "AtRest",
    "Displaced",
    "Multisine",
    "Posed",
    "Pulled",
    "RunSpec",
    "SampleRates",
    "SessionSpec",
    "StaticSpec",
    "Truth",
    "UnbalancedMass",
    "case_spec",
    "simulate_session",
]
