"""Random serial arms as MJCF: hinges and slides, odd axes and anchors, several joints a body."""

import numpy as np


def numbers(values: np.ndarray) -> str:
    return " ".join(f"{value:.17g}" for value in np.atleast_1d(values))


def joint(rng: np.random.Generator, number: int, slides: bool) -> str:
    low = rng.uniform(-2.5, -0.5)
    high = rng.uniform(0.5, 2.5)
    limits = f'range="{numbers(np.array([low, high]))}"' if rng.random() < 0.8 else ""
    kind = "slide" if slides else "hinge"
    return (
        f'<joint name="j{number}" type="{kind}" axis="{numbers(rng.normal(size=3))}" '
        f'pos="{numbers(rng.uniform(-0.2, 0.2, 3))}" ref="{numbers(rng.uniform(-0.3, 0.3))}" '
        f"{limits}/>"
    )


def random_arm(rng: np.random.Generator, joint_count: int, slide_share: float = 0.3) -> str:
    """A model whose camera "eye", site "tool" and body "last" hang on so many joints."""
    head, tail, number = "", "", 0
    while number < joint_count:
        head += (
            f'<body pos="{numbers(rng.uniform(-0.4, 0.4, 3))}" '
            f'quat="{numbers(rng.normal(size=4))}"><geom size="0.02" mass="0.1"/>'
        )
        here = min(int(rng.choice([0, 1, 1, 1, 2, 3])), joint_count - number)
        for _ in range(here):
            head += joint(rng, number, bool(rng.random() < slide_share))
            number += 1
        # A side branch, so that joints outside the chain share the model.
        head += f'<body pos="0.1 0 0"><joint name="side{len(tail)}"/><geom size="0.02"/></body>'
        tail += "</body>"
    place = f'pos="{numbers(rng.uniform(-0.2, 0.2, 3))}" quat="{numbers(rng.normal(size=4))}"'
    last = f'<body name="last" {place}><geom size="0.02"/><camera name="eye" {place}/>'
    return (
        '<mujoco><compiler angle="radian" autolimits="true"/><worldbody>'
        f'{head}{last}<site name="tool" {place}/></body>{tail}</worldbody></mujoco>'
    )
