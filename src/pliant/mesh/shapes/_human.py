"""Skeleton, flesh and named poses of the human figure: 1.75 m, arms held 45 degrees away from the body.

x points to the figure's left, y up, z to the front.
"""

from __future__ import annotations

from ._body import Blob, Body, Joint, Limb, Turns, chain

HUMAN = Body(
    joints=(
        Joint("pelvis", None, (0, 0.97, 0)),
        Joint("spine", "pelvis", (0, 1.07, -0.01), ((-15, 30), (-15, 15), (-10, 10))),
        Joint("chest", "spine", (0, 1.22, -0.01), ((-10, 20), (-15, 15), (-10, 10))),
        Joint("neck", "chest", (0, 1.44, -0.02), ((-15, 20), (-20, 20), (-10, 10))),
        Joint("head", "neck", (0, 1.56, -0.005), ((-15, 20), (-30, 30), (-10, 10))),
        Joint("left_clavicle", "chest", (0.03, 1.39, -0.01), ((0, 0), (-8, 8), (-8, 15))),
        Joint("left_shoulder", "left_clavicle", (0.175, 1.385, -0.02), ((-20, 20), (-60, 30), (-35, 50))),
        Joint("left_elbow", "left_shoulder", (0.365, 1.18, -0.025), ((-60, 0), (-55, 0), (0, 0))),
        Joint("left_wrist", "left_elbow", (0.52, 1.01, 0), ((-20, 20), (-10, 10), (-30, 30))),
        Joint("left_hip", "pelvis", (0.095, 0.92, 0), ((-70, 20), (-10, 10), (-5, 20))),
        Joint("left_knee", "left_hip", (0.112, 0.50, 0.008), ((0, 80), (0, 0), (0, 0))),
        Joint("left_ankle", "left_knee", (0.118, 0.08, -0.02), ((-20, 20), (-5, 5), (-5, 5))),
        Joint("left_toes", "left_ankle", (0.125, 0.025, 0.10), ((-25, 5), (0, 0), (0, 0))),
    ),
    limbs=(
        Limb(
            chain(
                ("pelvis", "pelvis", "spine", "spine", "chest", "chest"),
                ("hips", "hips", "torso", "torso", "torso", "torso"),
                (
                    (0, 0.90, -0.005),
                    (0, 0.975, -0.008),
                    (0, 1.06, 0),
                    (0, 1.13, 0.004),
                    (0, 1.20, 0.002),
                    (0, 1.29, 0),
                    (0, 1.385, -0.015),
                ),
                (0.080, 0.102, 0.094, 0.087, 0.093, 0.102, 0.068),
                stretch=(1.5, 1, 1),
            ),
            blend=0.003,
            join=0,
        ),
        Limb(
            (Blob("pelvis", "hips", (0.06, 0.93, -0.045), 0.075, (0.055, 0.89, -0.04), 0.07),), 0, 0.05, True
        ),
        Limb(
            (Blob("chest", "torso", (0.085, 1.31, 0.045), 0.05, (0.05, 1.28, 0.055), 0.045),), 0, 0.06, True
        ),
        Limb(
            chain(
                ("left_clavicle", "left_shoulder", "left_shoulder", "left_elbow", "left_elbow"),
                ("torso", "left arm", "left arm", "left arm", "left arm"),
                (
                    (0.06, 1.40, -0.02),
                    (0.165, 1.385, -0.02),
                    (0.245, 1.31, -0.022),
                    (0.365, 1.18, -0.025),
                    (0.41, 1.13, -0.018),
                    (0.52, 1.01, 0),
                ),
                (0.052, 0.056, 0.047, 0.037, 0.039, 0.024),
            ),
            blend=0.003,
            join=0.05,
            paired=True,
        ),
        Limb(
            chain(
                ("left_hip", "left_hip", "left_knee", "left_knee"),
                ("left leg",) * 4,
                (
                    (0.095, 0.90, 0),
                    (0.108, 0.76, 0.005),
                    (0.112, 0.50, 0.008),
                    (0.116, 0.37, -0.018),
                    (0.118, 0.09, -0.02),
                ),
                (0.088, 0.081, 0.052, 0.056, 0.033),
            ),
            blend=0.003,
            join=0.04,
            paired=True,
        ),
        Limb(
            (
                Blob("left_ankle", "left foot", (0.118, 0.075, -0.025), 0.036, (0.118, 0.035, -0.045), 0.034),
                Blob(
                    "left_ankle",
                    "left foot",
                    (0.118, 0.065, 0),
                    0.036,
                    (0.127, 0.03, 0.10),
                    0.027,
                    (1.2, 1, 1),
                ),
                Blob(
                    "left_toes",
                    "left foot",
                    (0.127, 0.027, 0.10),
                    0.026,
                    (0.129, 0.02, 0.15),
                    0.018,
                    (1.4, 1, 1),
                ),
            ),
            blend=0.025,
            join=0.02,
            paired=True,
        ),
        Limb(
            chain(
                ("neck", "neck"),
                ("neck", "neck"),
                ((0, 1.39, -0.025), (0, 1.475, -0.02), (0, 1.57, -0.003)),
                (0.062, 0.054, 0.053),
            ),
            blend=0.003,
            join=0.05,
        ),
        Limb(
            (
                Blob("head", "head", (0, 1.665, -0.015), 0.092, (0, 1.672, 0), 0.09, (0.88, 1, 1)),
                Blob("head", "head", (0, 1.61, 0.03), 0.06, (0, 1.565, 0.06), 0.032),
            ),
            blend=0.05,
            join=0.03,
        ),
        Limb((Blob("head", "head", (0, 1.65, 0.084), 0.009, (0, 1.612, 0.106), 0.012),), 0, 0.022),
        Limb(
            (
                Blob(
                    "head", "head", (0.080, 1.657, -0.014), 0.022, (0.080, 1.625, -0.006), 0.014, (0.6, 1, 1)
                ),
            ),
            0,
            0.012,
            True,
        ),
        Limb(
            (
                Blob("left_wrist", "left hand", (0.52, 1.01, 0), 0.024, (0.54, 0.985, 0.004), 0.023),
                Blob("left_wrist", "left hand", (0.54, 0.985, 0.012), 0.019, (0.575, 0.940, 0.028), 0.0160),
                Blob("left_wrist", "left hand", (0.54, 0.985, 0.004), 0.019, (0.580, 0.934, 0.008), 0.0165),
                Blob("left_wrist", "left hand", (0.54, 0.985, -0.004), 0.019, (0.575, 0.938, -0.012), 0.0160),
                Blob("left_wrist", "left hand", (0.575, 0.940, 0.032), 0.0130, (0.606, 0.890, 0.068), 0.0100),
                Blob("left_wrist", "left hand", (0.580, 0.932, 0.016), 0.0130, (0.627, 0.862, 0.030), 0.0105),
                Blob(
                    "left_wrist", "left hand", (0.580, 0.932, -0.001), 0.0130, (0.625, 0.864, -0.010), 0.0100
                ),
                Blob(
                    "left_wrist", "left hand", (0.575, 0.938, -0.016), 0.0125, (0.602, 0.895, -0.048), 0.0095
                ),
                Blob("left_wrist", "left hand", (0.535, 0.988, 0.018), 0.018, (0.543, 0.972, 0.056), 0.0140),
                Blob("left_wrist", "left hand", (0.543, 0.972, 0.056), 0.014, (0.560, 0.944, 0.088), 0.0105),
            ),
            blend=0.016,
            join=0.02,
            paired=True,
        ),
    ),
)

_ARMS_DOWN: Turns = {"left_shoulder": (0, 0, -32), "right_shoulder": (0, 0, 32)}

HUMAN_POSES: dict[str, Turns] = {
    "rest": {},
    "walk": {
        "left_hip": (-25, 0, 0), "left_knee": (12, 0, 0), "left_ankle": (5, 0, 0),
        "right_hip": (20, 0, 0), "right_knee": (22, 0, 0), "right_ankle": (8, 0, 0), "right_toes": (-20, 0, 0),
        "left_shoulder": (22, 0, -30), "right_shoulder": (-22, 0, 30),
        "left_elbow": (-15, -13, 0), "right_elbow": (-22, 19, 0),
        "spine": (3, -5, 0), "chest": (0, -6, 0), "head": (0, 6, 0),
    },
    "run": {
        "pelvis": (12, 0, 0), "left_hip": (-62, 0, 0), "left_knee": (66, 0, 0), "left_ankle": (5, 0, 0),
        "right_hip": (22, 0, 0), "right_knee": (50, 0, 0), "right_ankle": (20, 0, 0), "right_toes": (-15, 0, 0),
        "left_shoulder": (40, 0, -22), "right_shoulder": (-40, 0, 22),
        "left_elbow": (-55, -48, 0), "right_elbow": (-55, 48, 0),
        "spine": (6, -8, 0), "chest": (4, -8, 0), "neck": (-8, 5, 0), "head": (-6, 6, 0),
    },
    "sit": {
        "left_hip": (-82, 0, 8), "right_hip": (-82, 0, -8), "left_knee": (82, 0, 0), "right_knee": (82, 0, 0),
        "left_shoulder": (-25, 0, -24), "right_shoulder": (-25, 0, 24),
        "left_elbow": (-40, -35, 0), "right_elbow": (-40, 35, 0), "spine": (4, 0, 0), "head": (5, 0, 0),
    },
    "wave": {
        "left_clavicle": (0, 0, 15), "left_shoulder": (0, 0, 60), "left_elbow": (-20, -10, 55),
        "left_wrist": (0, 0, 12), "right_shoulder": (0, 0, 32), "right_elbow": (-8, 7, 0),
        "head": (0, 12, 6), "spine": (0, 0, 3),
    },
    "crouch": {
        "pelvis": (20, 0, 0), "spine": (22, 0, 0), "chest": (18, 0, 0), "neck": (-18, 0, 0), "head": (-14, 0, 0),
        "left_hip": (-92, 0, 14), "right_hip": (-92, 0, -14), "left_knee": (92, 0, 0), "right_knee": (92, 0, 0),
        "left_ankle": (-28, 0, 0), "right_ankle": (-28, 0, 0),
        "left_shoulder": (-45, 0, -12), "right_shoulder": (-45, 0, 12),
        "left_elbow": (-35, -30, 0), "right_elbow": (-35, 30, 0),
    },
    "reach": {
        "left_clavicle": (0, -5, 12), "left_shoulder": (-30, -55, 35), "left_wrist": (0, 0, 10),
        "right_shoulder": (15, 0, 28), "spine": (8, -12, 0), "chest": (4, -14, 0), "head": (-8, 14, 0),
        "left_hip": (-18, 0, 0), "left_knee": (20, 0, 0), "right_hip": (16, 0, 0),
    },
    "bow": {
        "spine": (30, 0, 0), "chest": (26, 0, 0), "neck": (14, 0, 0), "head": (10, 0, 0), "pelvis": (18, 0, 0),
        "left_hip": (-18, 0, 0), "right_hip": (-18, 0, 0), **_ARMS_DOWN,
    },
}  # fmt: skip
