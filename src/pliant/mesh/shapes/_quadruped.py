"""Skeleton, flesh and named poses of the four-legged figure: built like a small horse, a metre at the withers.

x points to the figure's left, y up, z to the front.
"""

from __future__ import annotations

from ._body import Blob, Body, Joint, Limb, Turns, chain

QUADRUPED = Body(
    joints=(
        Joint("pelvis", None, (0, 0.95, -0.42)),
        Joint("spine", "pelvis", (0, 0.96, -0.18), ((-10, 12), (-12, 12), (-6, 6))),
        Joint("chest", "spine", (0, 0.95, 0.10), ((-10, 12), (-12, 12), (-6, 6))),
        Joint("neck", "chest", (0, 1.02, 0.44), ((-20, 45), (-25, 25), (-8, 8))),
        Joint("neck_top", "neck", (0, 1.22, 0.62), ((-15, 25), (-25, 25), (-8, 8))),
        Joint("head", "neck_top", (0, 1.41, 0.78), ((-20, 20), (-20, 20), (-12, 12))),
        Joint("left_ear", "head", (0.045, 1.49, 0.79), ((-15, 25), (0, 0), (-15, 15))),
        Joint("tail_base", "pelvis", (0, 1.02, -0.66), ((-15, 30), (-25, 25), (-10, 10))),
        Joint("tail_middle", "tail_base", (0, 0.84, -0.80), ((-20, 25), (-25, 25), (-15, 15))),
        Joint("left_shoulder", "chest", (0.11, 0.86, 0.38), ((-40, 30), (-5, 5), (-3, 8))),
        Joint("left_elbow", "left_shoulder", (0.135, 0.66, 0.34), ((-40, 10), (0, 0), (0, 0))),
        Joint("left_carpus", "left_elbow", (0.135, 0.38, 0.37), ((0, 70), (0, 0), (0, 0))),
        Joint("left_front_fetlock", "left_carpus", (0.135, 0.13, 0.37), ((-20, 40), (0, 0), (0, 0))),
        Joint("left_hip", "pelvis", (0.12, 0.88, -0.48), ((-40, 30), (-5, 5), (-3, 8))),
        Joint("left_stifle", "left_hip", (0.155, 0.66, -0.38), ((-10, 50), (0, 0), (0, 0))),
        Joint("left_hock", "left_stifle", (0.14, 0.42, -0.61), ((-50, 15), (0, 0), (0, 0))),
        Joint("left_hind_fetlock", "left_hock", (0.14, 0.13, -0.57), ((-20, 40), (0, 0), (0, 0))),
    ),
    limbs=(
        Limb(
            chain(
                ("pelvis", "spine", "chest", "chest"),
                ("hindquarters", "trunk", "trunk", "trunk"),
                ((0, 0.925, -0.52), (0, 0.92, -0.20), (0, 0.895, 0.12), (0, 0.90, 0.30), (0, 0.93, 0.42)),
                (0.175, 0.20, 0.225, 0.215, 0.17),
                stretch=(0.9, 1, 1),
            ),
            blend=0.003,
            join=0,
        ),
        Limb(
            chain(
                ("left_shoulder", "left_elbow", "left_elbow", "left_carpus", "left_carpus"),
                ("left front leg",) * 5,
                (
                    (0.095, 0.87, 0.38),
                    (0.135, 0.66, 0.34),
                    (0.135, 0.54, 0.355),
                    (0.135, 0.38, 0.37),
                    (0.135, 0.26, 0.368),
                    (0.135, 0.13, 0.37),
                ),
                (0.125, 0.078, 0.060, 0.046, 0.033, 0.038),
            ),
            blend=0.003,
            join=0.06,
            paired=True,
        ),
        Limb(
            chain(
                ("left_hip", "left_stifle", "left_stifle", "left_hock", "left_hock"),
                ("left hind leg",) * 5,
                (
                    (0.085, 0.90, -0.51),
                    (0.145, 0.68, -0.40),
                    (0.145, 0.55, -0.49),
                    (0.14, 0.42, -0.61),
                    (0.14, 0.28, -0.585),
                    (0.14, 0.13, -0.57),
                ),
                (0.165, 0.105, 0.075, 0.047, 0.036, 0.040),
            ),
            blend=0.003,
            join=0.06,
            paired=True,
        ),
        Limb(
            chain(
                ("left_front_fetlock", "left_front_fetlock"),
                ("left front leg",) * 2,
                ((0.135, 0.13, 0.37), (0.135, 0.065, 0.405), (0.135, 0.04, 0.425)),
                (0.034, 0.038, 0.044),
            ),
            blend=0.003,
            join=0.015,
            paired=True,
        ),
        Limb(
            chain(
                ("left_hind_fetlock", "left_hind_fetlock"),
                ("left hind leg",) * 2,
                ((0.14, 0.13, -0.57), (0.14, 0.065, -0.54), (0.14, 0.04, -0.52)),
                (0.036, 0.038, 0.043),
            ),
            blend=0.003,
            join=0.015,
            paired=True,
        ),
        Limb(
            chain(
                ("neck", "neck_top"),
                ("neck", "neck"),
                ((0, 0.98, 0.42), (0, 1.22, 0.62), (0, 1.41, 0.775)),
                (0.165, 0.115, 0.082),
                stretch=(0.8, 1, 1),
            ),
            blend=0.003,
            join=0.09,
        ),
        Limb(
            (
                Blob("head", "head", (0, 1.435, 0.81), 0.088, (0, 1.37, 0.93), 0.075, (0.9, 1, 1)),
                Blob("head", "head", (0, 1.37, 0.93), 0.070, (0, 1.245, 1.10), 0.050, (0.92, 1, 1)),
                Blob("head", "head", (0, 1.36, 0.845), 0.062, (0, 1.225, 1.06), 0.036, (0.9, 1, 1)),
                Blob("head", "head", (0, 1.235, 1.10), 0.053, (0, 1.222, 1.11), 0.050),
            ),
            blend=0.035,
            join=0.05,
        ),
        Limb(
            (Blob("head", "head", (0.058, 1.42, 0.885), 0.026, (0.06, 1.41, 0.895), 0.024),), 0, 0.025, True
        ),
        Limb(
            (Blob("left_ear", "head", (0.042, 1.49, 0.79), 0.030, (0.068, 1.615, 0.80), 0.011),),
            0,
            0.02,
            True,
        ),
        Limb(
            chain(
                ("tail_base", "tail_base", "tail_middle", "tail_middle"),
                ("tail",) * 4,
                ((0, 1.02, -0.64), (0, 0.96, -0.74), (0, 0.84, -0.80), (0, 0.62, -0.84), (0, 0.42, -0.85)),
                (0.044, 0.042, 0.044, 0.048, 0.018),
            ),
            blend=0.003,
            join=0.04,
        ),
    ),
)

QUADRUPED_POSES: dict[str, Turns] = {
    "rest": {},
    "walk": {
        "left_shoulder": (-22, 0, 0), "left_elbow": (-5, 0, 0), "left_carpus": (12, 0, 0),
        "right_shoulder": (18, 0, 0), "right_carpus": (12, 0, 0), "right_front_fetlock": (15, 0, 0),
        "left_hip": (20, 0, 0), "left_hock": (-8, 0, 0), "left_hind_fetlock": (15, 0, 0),
        "right_hip": (-22, 0, 0), "right_stifle": (18, 0, 0), "right_hock": (-16, 0, 0),
        "neck": (8, 4, 0), "spine": (0, 4, 0), "tail_base": (0, 10, 0),
    },
    "gallop": {
        "pelvis": (-4, 0, 0), "spine": (-6, 0, 0), "chest": (-4, 0, 0), "neck": (28, 0, 0), "head": (-18, 0, 0),
        "left_shoulder": (-48, 0, 0), "left_elbow": (-14, 0, 0), "left_carpus": (14, 0, 0),
        "right_shoulder": (-30, 0, 0), "right_elbow": (-25, 0, 0), "right_carpus": (60, 0, 0),
        "right_front_fetlock": (25, 0, 0),
        "left_hip": (36, 0, 0), "left_stifle": (-8, 0, 0), "left_hock": (12, 0, 0), "left_hind_fetlock": (25, 0, 0),
        "right_hip": (24, 0, 0), "right_stifle": (12, 0, 0), "right_hind_fetlock": (25, 0, 0),
        "tail_base": (38, 0, 0), "tail_middle": (-12, 0, 0),
    },
    "sit": {
        "pelvis": (-38, 0, 0), "spine": (-4, 0, 0), "neck": (14, 0, 0), "neck_top": (8, 0, 0), "head": (14, 0, 0),
        "left_hip": (-40, 0, 8), "right_hip": (-40, 0, -8), "left_stifle": (54, 0, 0), "right_stifle": (54, 0, 0),
        "left_hock": (-42, 0, 0), "right_hock": (-42, 0, 0),
        "left_shoulder": (32, 0, 0), "right_shoulder": (32, 0, 0), "left_elbow": (4, 0, 0), "right_elbow": (4, 0, 0),
        "tail_base": (40, 0, 0), "tail_middle": (10, 0, 0),
    },
    "lie": {
        "left_shoulder": (22, 0, 4), "right_shoulder": (22, 0, -4), "left_elbow": (-98, 0, 0),
        "right_elbow": (-98, 0, 0), "left_carpus": (12, 0, 0), "right_carpus": (12, 0, 0),
        "left_hip": (-52, 0, 14), "right_hip": (-52, 0, -14), "left_stifle": (54, 0, 0), "right_stifle": (54, 0, 0),
        "left_hock": (-60, 0, 0), "right_hock": (-60, 0, 0), "neck": (6, 8, 0), "tail_base": (20, 14, 0),
    },
    "graze": {
        "neck": (58, 0, 0), "neck_top": (28, 0, 0), "head": (-14, 0, 0), "chest": (6, 0, 0),
        "left_shoulder": (-16, 0, 0), "right_shoulder": (10, 0, 0), "left_ear": (20, 0, 0),
    },
    "look_back": {
        "spine": (0, 10, 0), "chest": (0, 14, 0), "neck": (0, 42, 0), "neck_top": (0, 42, 0), "head": (0, 24, 0),
        "tail_base": (0, 22, 0), "left_hip": (-8, 0, 0), "right_hip": (8, 0, 0),
    },
    "rear": {
        "pelvis": (-42, 0, 0), "spine": (-8, 0, 0), "chest": (-6, 0, 0), "neck": (10, 0, 0), "head": (12, 0, 0),
        "left_hip": (20, 0, 0), "right_hip": (28, 0, 0), "left_stifle": (14, 0, 0), "right_stifle": (6, 0, 0),
        "left_shoulder": (-26, 0, 0), "right_shoulder": (-10, 0, 0), "left_elbow": (-30, 0, 0),
        "right_elbow": (-25, 0, 0), "left_carpus": (80, 0, 0), "right_carpus": (70, 0, 0),
        "tail_base": (25, 0, 0),
    },
}  # fmt: skip
