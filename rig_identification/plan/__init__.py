"""Before the body hangs: what a session would tell, which runs tell most, and what would bias them."""

from rig_identification.plan.before import Before, Known, Stated
from rig_identification.plan.guess import box
from rig_identification.plan.means import Means
from rig_identification.plan.planning import Plan, plan

__all__ = ["Before", "Known", "Means", "Plan", "Stated", "box", "plan"]
