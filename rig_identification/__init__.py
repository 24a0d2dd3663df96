"""Mass, centre of mass and inertia tensor of a body on a cable rig, and what the rig's model left out."""

__version__ = "0.1.0"
