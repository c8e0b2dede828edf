"""The table of effects: one line each, in the order in which they are decided.

A key stands for the file of its name, with underscores for hyphens, which has `KEY` and `decide(inputs) -> Effect`.
"""

from importlib import import_module

from ..errors import InputError

BOTH = ("gather", "forward")

TABLE = {  # key -> estimators for which it may be switched on
    "trees": BOTH,
    "terrain-horizon": BOTH,
    "sky-rays": BOTH,
    "shadow-rays": BOTH,
    "receivers": ("gather",),
    "reflections": BOTH,
    "reflectors": ("gather",),
    "far-ground": BOTH,
    "perez": BOTH,
    "specular": BOTH,
    "aoi": BOTH,
    "spectrum": BOTH,
    "temperature": BOTH,
}
RAYS = ("sky-rays", "shadow-rays")  # photons need none of them, so that forward cannot leave them out


def check_effects(request):
    """Refuse effects that do not exist, or that the estimator cannot have.

    Raises
    ------
    InputError
        Names the key, and the keys that exist.
    """
    for key, on in request.effects.items():
        if key not in TABLE:
            raise InputError("--effects", f"no effect is called {key!r}", f"use {', '.join(TABLE)}")
        if on and request.estimator not in TABLE[key]:
            name = TABLE[key][0]
            raise InputError("--effects", f"{key} is for {name} only", f"leave it out or use --estimator {name}")


def check_needs(request):
    """Refuse effects that lack what they need for tracing.

    Raises
    ------
    InputError
        Rays are switched off for photons, or there is no horizon to be switched on.
    """
    for key in RAYS:
        if request.estimator == "forward" and request.effects.get(key) is False:
            raise InputError("--effects", f"{key}=off is for gather only", "leave it out or use --estimator gather")
    if request.effects.get("terrain-horizon") and request.horizon is None:
        raise InputError("--effects", "terrain-horizon needs a horizon", "give --horizon FILE")


def decide_effect(key, inputs):
    """Decision on one effect: Effect."""
    return import_module(f".{key.replace('-', '_')}", __package__).decide(inputs)
