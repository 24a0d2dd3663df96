"""What each key of a description means, in a sentence: for the JSON Schema and for files that are written."""

from __future__ import annotations

#: Key path -> sentence without its unit, which the validation knows. ``CABLE`` stands for any cable's name.
RIG = {
    "gravity": "Magnitude of gravity, which acts along world -z.",
    "mass": "Mass of body and carrying frame together, from a scale. Leave it out if you did not weigh them.",
    "mass_std": "Standard deviation of the scale's reading.",
    "cable_linear_density": "Mass of a metre of cable. Left out, the cables' mass stays a doubt.",
    "frame": "The carrying frame alone. Leave it out if it is part of the body.",
    "frame.mass": "Mass of the frame.",
    "frame.center_of_mass": "Its centre of mass, in body.",
    "frame.inertia": "Its inertia xx xy xz yy yz zz about its own centre of mass, body axes.",
    "cables": "Names of the cables. Each is described below by a key of its name.",
    "CABLE.ceiling_point": "Hinge on the ceiling, in world (z up).",
    "CABLE.body_point": "Hinge on the body, in body.",
    "CABLE.length": "Between the two hinge centres, unloaded.",
    "CABLE.load_cell": "The end that carries the load cell.",
    "imu": "Where the IMU sits.",
    "imu.position": "Its origin, in body.",
    "imu.orientation": "Quaternion x y z w that turns IMU axes into body axes.",
    "inclinometer": "How the inclinometer is turned. Its position does not matter.",
    "inclinometer.orientation": "Quaternion x y z w that turns inclinometer axes into body axes.",
    "exciter": "Where the exciter acts.",
    "exciter.position": "Where its force acts, in body.",
    "exciter.orientation": "Quaternion x y z w that turns exciter axes into body axes.",
    "mocap": "Pose of the marker frame in body. Left out, it is estimated.",
    "mocap.position": "Origin of the marker frame, in body.",
    "mocap.orientation": "Quaternion x y z w that turns marker axes into body axes.",
    "noise": "Standard deviation of one sample. What is left out is estimated.",
    "tolerance": "Standard deviation of what you believe. What is left out has a default.",
}
SESSION = {
    "rig": "Path of the rig description, from this file.",
    "recordings": "The bags of this session: one body on one rig on one day.",
    "recordings.bag": "Folder or file of the bag, from this file.",
    "recordings.kind": "static: the body hangs at rest. dynamic: it moves.",
    "recordings.holdout": "true: the run only scores the fit.",
    "recordings.dummy": "A known mass that is fixed to the body in this recording at rest.",
    "recordings.dummy.mass": "Its mass.",
    "recordings.dummy.position": "Where its centre of mass is, in body.",
}
