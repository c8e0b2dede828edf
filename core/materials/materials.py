"""Named materials: reflection of walls, roofs and streets, each with its source.

The albedo of a material is the middle of the range in its source. Real facades differ; a measured albedo is better.
"""

import re
from dataclasses import dataclass

from ..settings.errors import InputError
from .brdf_glass import Glass
from .brdf_glossy import Glossy
from .brdf_lambertian import Lambertian
from .brdf_mirror import Mirror

OKE = "T. R. Oke (1987), Boundary layer climates, 2nd edition, Methuen"
PVSYST = "PVsyst, Albedo usual coefficients, www.pvsyst.com/help/physical-models-used/irradiation-models"
STOKES = "Fresnel's equations, G. G. Stokes (1862), Proceedings of the Royal Society of London 11"
DE_SOTO = "Fresnel's equations, glass of W. De Soto et al. (2006), doi:10.1016/j.solener.2005.06.010"
HALE = "Fresnel's equations, water of G. M. Hale, M. R. Querry (1973), doi:10.1364/AO.12.000555"

DIFFUSE = {  # name -> lowest and highest albedo, source
    "aluminium": (0.85, 0.85, PVSYST),
    "asphalt": (0.05, 0.20, OKE),
    "black paint": (0.02, 0.15, OKE),
    "brick": (0.20, 0.40, OKE),
    "coloured paint": (0.20, 0.35, OKE),  # red, brown, green
    "concrete": (0.10, 0.35, OKE),
    "conifers": (0.05, 0.15, OKE),
    "copper": (0.74, 0.74, PVSYST),
    "corrugated iron": (0.10, 0.16, OKE),
    "deciduous trees": (0.15, 0.20, OKE),
    "dirty galvanised steel": (0.08, 0.08, PVSYST),
    "galvanised steel": (0.35, 0.35, PVSYST),
    "grass": (0.16, 0.26, OKE),
    "red tile": (0.33, 0.33, PVSYST),
    "sand": (0.20, 0.45, OKE),  # desert
    "slate": (0.10, 0.10, OKE),
    "snow": (0.40, 0.95, OKE),  # old to fresh
    "soil": (0.05, 0.40, OKE),  # dark and wet to light and dry
    "stone": (0.20, 0.35, OKE),
    "tar and gravel": (0.08, 0.18, OKE),
    "thatch": (0.15, 0.20, OKE),
    "tile": (0.10, 0.35, OKE),
    "white paint": (0.50, 0.90, OKE),
}
CLEAR = {  # name -> BRDF, source
    "glass": (Glass(interfaces=2), STOKES),
    "double glazing": (Glass(interfaces=4), STOKES),
    "photovoltaic module": (Glass(refractive_index=1.526, interfaces=1), DE_SOTO),
    "water": (Glass(refractive_index=1.333, interfaces=1), HALE),
}
WORDS = (*DIFFUSE, *CLEAR, "mirror", "glossy:ROUGHNESS")


@dataclass(frozen=True)
class MaterialSpec:
    """Albedo, material, or both, as given for a surface in a line of the albedo file."""

    albedo: float | None = None
    material: str = ""

    def brdf(self):
        """BRDF of this specification.

        Raises
        ------
        InputError
            The albedo is not between 0 and 1, or the material is not known.
        """
        if self.albedo is not None and not 0 <= self.albedo <= 1:
            raise InputError(self.material or "albedo", f"albedo {self.albedo:g}", "give a number from 0 to 1")
        return brdf_of_material(self.material, self.albedo) if self.material else Lambertian(self.albedo)


def brdf_of_material(name, albedo=None):
    """BRDF of a material.

    Parameters
    ----------
    name : str
        A named material, `mirror`, or `glossy:ROUGHNESS` with a roughness above 0 and up to 1.
    albedo : float, optional
        Overrides the material's own. Required for mirrors and glossy surfaces; not allowed for glass and water.

    Returns
    -------
    Lambertian, Mirror, Glossy or Glass

    Raises
    ------
    InputError
    """
    word, _, number = name.partition(":")
    if word in CLEAR and not number:
        if albedo is not None:
            raise InputError(name, "reflects by Fresnel's equations", "leave its albedo empty")
        return CLEAR[word][0]
    if word in DIFFUSE and not number:
        least, most, _ = DIFFUSE[word]
        return Lambertian((least + most) / 2 if albedo is None else albedo)
    if name == "mirror" or word == "glossy":
        if albedo is None:
            raise InputError(name, "needs an albedo", "give one")
        return Mirror(albedo) if name == "mirror" else Glossy(albedo, read_roughness(name, number))
    raise InputError(name, "is not a known material", f"use one of {', '.join(WORDS)}")


def read_roughness(name, text):
    """Roughness of a glossy surface."""
    try:
        roughness = float(text)
    except ValueError:
        roughness = 0.0
    if not 0 < roughness <= 1:
        raise InputError(name, "needs a roughness above 0 and up to 1", "write for example glossy:0.1")
    return roughness


def recognise_material(name):
    """Known material for a name from another program: "White_Paint.001" is white paint; "" if there is none.

    Case, underscores, hyphens and the number of a copy are ignored; the whole name must match.
    """
    plain = " ".join(re.sub(r"\.\d+$", "", name).replace("_", " ").replace("-", " ").lower().split())
    return plain if plain in (*DIFFUSE, *CLEAR, "mirror") else ""


def describe_brdf(brdf):
    """Short description of a BRDF."""
    if isinstance(brdf, Glossy):
        return f"glossily, roughness {brdf.roughness:.2g}"
    return {Lambertian: "evenly", Mirror: "as a mirror", Glass: "as glass or water"}[type(brdf)]
