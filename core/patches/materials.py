"""Named materials, and materials of computer graphics: how walls, roofs and streets reflect, each
with its source.

The albedo of a material is the middle of the range in its source. Real facades differ; a measured
albedo is better.

The albedo of a shader (base colour, metallic, roughness, transmission) is the luminance of the base
colour, Y = 0.2126 R + 0.7152 G + 0.0722 B (ITU-R BT.709-6, linear RGB), as given by "RGB to BW" in
Blender. This is the visible reflectance. About half of the solar power is infrared, and bricks,
tiles and leaves reflect more of that half; a colour does not tell how much. A shader mixes metal,
glass and a diffuse base; the one with more than half of the weight is taken. The clear coat over a
diffuse base (4 % at normal incidence) is neglected.

References
----------
B. Burley (2012), Physically based shading at Disney, SIGGRAPH course notes: the α of GGX is the
roughness squared.
"""

import re
from contextlib import suppress
from dataclasses import dataclass

from ..settings.errors import InputError
from .brdfs import Glass, Glossy, Lambertian, Mirror

OKE = "T. R. Oke (1987), Boundary layer climates, 2nd edition, Methuen"
PVSYST = (
    "PVsyst, Albedo usual coefficients, www.pvsyst.com/help/physical-models-used/irradiation-models"
)
STOKES = "Fresnel's equations, G. G. Stokes (1862), Proceedings of the Royal Society of London 11"

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
    "photovoltaic module": (
        Glass(refractive_index=1.526, interfaces=1),
        (
            "Fresnel's equations, glass of W. De Soto et al. (2006), "
            "doi:10.1016/j.solener.2005.06.010"
        ),
    ),
    "water": (
        Glass(refractive_index=1.333, interfaces=1),
        ("Fresnel's equations, water of G. M. Hale, M. R. Querry (1973), doi:10.1364/AO.12.000555"),
    ),
}
WORDS = (*DIFFUSE, *CLEAR, "mirror", "glossy:ROUGHNESS")
EXAMPLES = (*WORDS[:-1], "glossy:0.1")  # to choose from


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
            raise InputError(
                self.material or "albedo", f"{self.albedo:g}", "give a number from 0 to 1"
            )
        return (
            brdf_of_material(self.material, self.albedo)
            if self.material
            else Lambertian(self.albedo)
        )

    def describe(self):
        """The reflection in words."""
        brdf = self.brdf()
        words = f"reflects {describe_brdf(brdf)}" + (
            "" if self.material in CLEAR else f", albedo {brdf.albedo:.3f}"
        )
        return f"{self.material}: {words}" if self.material else words

    @staticmethod
    def of_choice(choice, name, colour, *shader):
        """MaterialSpec by a user's choice, which counts before the material's name, and that before
        its shader; None if it cannot be determined.

        Parameters
        ----------
        choice, name : str
        colour, *shader
            As of `of_shader`.
        """
        word = recognise_material(choice) or choice or recognise_material(name)
        if word == "mirror" or word.startswith("glossy"):
            return None if colour is None else MaterialSpec(_albedo_of_colour(colour), word)
        return MaterialSpec(material=word) if word else MaterialSpec.of_shader(colour, *shader)

    @staticmethod
    def of_shader(colour, metallic=0.0, roughness=0.5, transmission=0.0):
        """MaterialSpec of a surface with such a shader.

        Parameters
        ----------
        colour : (3,) float, optional
            Linear Rec. 709.
        metallic, roughness, transmission : float, optional
            From 0 to 1, as in Blender's Principled BSDF. For all parameters None means unknown, for
            example given by a texture.

        Returns
        -------
        MaterialSpec or None
            None if a parameter that matters is unknown.
        """
        if metallic is None or (transmission is None and metallic < HALF):
            return None
        if metallic < HALF and transmission >= HALF:
            return MaterialSpec(material="glass")
        if colour is None or (metallic >= HALF and roughness is None):
            return None
        albedo = _albedo_of_colour(colour)
        if metallic < HALF or roughness >= ROUGH:
            return MaterialSpec(albedo)
        return MaterialSpec(
            albedo, "mirror" if roughness <= SMOOTH else f"glossy:{roughness**2:.4g}"
        )

    @staticmethod
    def of_name(name, colour=None):
        """MaterialSpec of a material in a file: by its name if that is known, else by its diffuse
        colour.

        Parameters
        ----------
        name : str
        colour : (3,) float, optional
            Linear Rec. 709; None if unknown.

        Returns
        -------
        MaterialSpec or None
            None if neither is known.
        """
        word = recognise_material(name)
        if word and word != "mirror":
            return MaterialSpec(material=word)
        return None if colour is None else MaterialSpec(_albedo_of_colour(colour), word)


def brdf_of_material(name, albedo=None):
    """BRDF of a material.

    Parameters
    ----------
    name : str
        A named material, `mirror`, or `glossy:ROUGHNESS` with a roughness above 0 and up to 1.
    albedo : float, optional
        Overrides the material's own. Required for mirrors and glossy surfaces; not allowed for
        glass and water.

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
        if name == "mirror":
            return Mirror(albedo)
        with suppress(ValueError):
            if 0 < float(number) <= 1:
                return Glossy(albedo, float(number))
        raise InputError(
            name, "needs a roughness above 0 and up to 1", "write for example glossy:0.1"
        )
    raise InputError(name, "is not a known material", f"use one of {', '.join(WORDS)}")


def recognise_material(name):
    """Known material for a name from another program: "White_Paint.001" is white paint; "" if there
    is none.

    Case, underscores, hyphens and the number of a copy are ignored; the whole name must match.
    """
    plain = " ".join(
        re.sub(r"\.\d+$", "", name).replace("_", " ").replace("-", " ").lower().split()
    )
    return plain if plain in (*DIFFUSE, *CLEAR, "mirror") else ""


def describe_brdf(brdf):
    """Short description of a BRDF."""
    if isinstance(brdf, Glossy):
        return f"glossily, roughness {brdf.roughness:.2g}"
    return {Lambertian: "evenly", Mirror: "as a mirror", Glass: "as glass or water"}[type(brdf)]


HALF = 0.5
SMOOTH = 0.05  # α 0.0025: the reflected sun is blurred by less than its angular diameter of 0.5°
ROUGH = 0.7  # α 0.49: GGX without multiple scattering would lose 29 % of an isotropic sky


def luminance(colour):
    """Luminance of a linear colour with the primaries of Rec. 709."""
    return sum(
        weight * float(part) for weight, part in zip((0.2126, 0.7152, 0.0722), colour, strict=True)
    )


def _albedo_of_colour(colour):
    """Luminance, rounded to remove the float32 errors of colours."""
    return round(luminance(colour), 4)
