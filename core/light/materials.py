"""Named materials: how walls, roofs and streets reflect.

The albedos are the middles of the ranges in T. R. Oke (1987), Boundary layer climates, 2nd edition, Methuen. Real
facades differ; a measured albedo is better.
"""

from ..errors import InputError
from .brdf_glass import Glass
from .brdf_glossy import Glossy
from .brdf_lambertian import Lambertian
from .brdf_mirror import Mirror

ALBEDO_RANGES = {
    "asphalt": (0.05, 0.20),
    "brick": (0.20, 0.40),
    "concrete": (0.10, 0.35),
    "stone": (0.20, 0.35),
    "tile": (0.10, 0.35),
    "white paint": (0.50, 0.90),
}
PANES = {"glass": 2, "double glazing": 4}  # interfaces between glass and air
WORDS = (*ALBEDO_RANGES, *PANES, "mirror", "glossy:ROUGHNESS")


def brdf_of_material(name, albedo=None):
    """Law of reflection of a material.

    Parameters
    ----------
    name : str
        Of a material, or `mirror`, or `glossy:ROUGHNESS` with a roughness above 0 and up to 1.
    albedo : float, optional
        Instead of the material's own. Mirrors and glossy faces have none of their own; panes take none.

    Returns
    -------
    Lambertian, Mirror, Glossy or Glass

    Raises
    ------
    InputError
    """
    word, _, number = name.partition(":")
    if word in PANES and not number:
        if albedo is not None:
            raise InputError(name, "reflects by Fresnel's equations", "leave its albedo empty")
        return Glass(interfaces=PANES[word])
    if word in ALBEDO_RANGES and not number:
        return Lambertian(sum(ALBEDO_RANGES[word]) / 2 if albedo is None else albedo)
    if name == "mirror" or word == "glossy":
        if albedo is None:
            raise InputError(name, "has no albedo of its own", "give one")
        return Mirror(albedo) if name == "mirror" else Glossy(albedo, read_roughness(name, number))
    raise InputError(name, "is no material", f"use {', '.join(WORDS)}")


def read_roughness(name, text):
    """Roughness of a glossy face."""
    try:
        roughness = float(text)
    except ValueError:
        roughness = 0.0
    if not 0 < roughness <= 1:
        raise InputError(name, "names no roughness above 0 and up to 1", "write glossy:0.1")
    return roughness
