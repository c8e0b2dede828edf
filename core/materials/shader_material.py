"""Convert a computer-graphics shader (base colour, metallic, roughness, transmission) to a MaterialSpec.

The albedo is the luminance of the base colour, Y = 0.2126 R + 0.7152 G + 0.0722 B (ITU-R BT.709-6, linear RGB), as
given by "RGB to BW" in Blender. This is the visible reflectance. About half of the solar power is infrared, of which
bricks, tiles and leaves reflect more; a colour does not tell how much.

A shader mixes metal, glass and a diffuse base; the one with more than half of the weight is taken. The clear coat over
a diffuse base (4 % at normal incidence) is neglected.

References
----------
B. Burley (2012), Physically based shading at Disney, SIGGRAPH course notes: the α of GGX is the roughness squared.
"""

from .materials import MaterialSpec, recognise_material

WEIGHTS = (0.2126, 0.7152, 0.0722)
DECIMALS = 4  # of an albedo
HALF = 0.5
SMOOTH = 0.05  # α 0.0025: the reflected sun is blurred by less than its angular diameter of 0.5°
ROUGH = 0.7  # α 0.49: GGX without multiple scattering would lose 29 % of an isotropic sky


def luminance(colour):
    """Luminance of a linear colour with the primaries of Rec. 709."""
    return sum(weight * float(part) for weight, part in zip(WEIGHTS, colour, strict=True))


def albedo_of_colour(colour):
    """Luminance, rounded to remove the float32 errors of colours."""
    return round(luminance(colour), DECIMALS)


def shader_material(colour, metallic=0.0, roughness=0.5, transmission=0.0):
    """MaterialSpec of a surface with such a shader.

    Parameters
    ----------
    colour : (3,) float, optional
        Linear Rec. 709.
    metallic, roughness, transmission : float, optional
        From 0 to 1, as in Blender's Principled BSDF. For all parameters None means unknown, for example given by a
        texture.

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
    albedo = albedo_of_colour(colour)
    if metallic < HALF or roughness >= ROUGH:
        return MaterialSpec(albedo)
    return MaterialSpec(albedo, "mirror" if roughness <= SMOOTH else f"glossy:{roughness**2:.4g}")


def named_material(name, colour=None):
    """MaterialSpec of a material in a file: by its name if that is known, else by its diffuse colour.

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
    return None if colour is None else MaterialSpec(albedo_of_colour(colour), word)
