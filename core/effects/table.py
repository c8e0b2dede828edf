"""The table of effects: one line each, in the order in which they are decided
(`plan_effects.RULES`).
"""

from typing import NamedTuple

from ..settings.errors import InputError
from ..settings.request import BEST_SKY

PLANNING = "planning effects"  # name of the stage


class Row(NamedTuple):
    """What is known of an effect before any scene."""

    title: str  # in Blender's panel
    words: str  # what it is, for tooltips
    forward: bool = True  # whether it may be switched on for photons


TABLE = {
    "trees": Row("Trees", "Crowns that let part of the light through, in leaf and bare"),
    "sky-rays": Row("Sky rays", "What stands between the surfaces and the sky"),
    "shadow-rays": Row("Shadow rays", "What stands between the surfaces and the suns"),
    "terrain-horizon": Row("Terrain horizon", "Terrain far from the city that hides suns and sky"),
    "receivers": Row(
        "Receivers", "Fewer rays for surfaces whose numbers are not wanted", forward=False
    ),
    "reflections": Row("Reflections", "How often light is followed from surface to surface"),
    "far-ground": Row(
        "Ground beyond the model", "Light from the open ground beyond the city, up to the horizon"
    ),
    BEST_SKY: Row(
        "Perez sky",
        "A sky that is brighter around the sun and at the horizon, instead of an even one",
    ),
    "specular": Row("Specular", "Mirrors, glossy faces, glass and water"),
    "string-shade": Row(
        "String shade", "What modules in series lose when shade moves over them", forward=False
    ),
    "aoi": Row(
        "Angle of incidence", "Direct light that the glass of the modules reflects at flat angles"
    ),
    "spectrum": Row("Spectrum", "The influence of the spectrum on the current of the modules"),
    "temperature": Row("Temperature", "Modules lose power as they get warm"),
}
# key of version 0.2 -> what holds whatever it is set to
RETIRED = {"reflectors": "all ground reflects"}


def check_effects(request):
    """Refuse effects that do not exist, that the estimator cannot have or leave out, or that lack
    what they need.

    Retired ones are passed over: `plan_effects` notes them.

    Raises
    ------
    InputError
        Names the key, and the keys that exist.
    """
    for key, on in request.effects.items():
        if key in RETIRED:
            continue
        if key not in TABLE:
            raise InputError("--effects", f"no effect is called {key!r}", f"use {', '.join(TABLE)}")
        # Photons need no rays of these kinds, so that forward cannot leave them out.
        possible = TABLE[key].forward if on else key not in ("sky-rays", "shadow-rays")
        if request.estimator == "forward" and not possible:
            words = key if on else f"{key}=off"
            raise InputError(
                "--effects", f"{words} is for gather only", "leave it out or use --estimator gather"
            )
    if request.effects.get("terrain-horizon") and request.horizon is None:
        raise InputError("--effects", "terrain-horizon needs a horizon", "give --horizon FILE")
