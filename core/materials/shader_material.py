"""What a shader of computer graphics says of light: its colour and finish as a MaterialSpec of ours.

The albedo is the luminance of the base colour, Y = 0.2126 R + 0.7152 G + 0.0722 B (ITU-R BT.709-6, of linear light):
what "RGB to BW" gives in Blender. It is what an eye sees reflected. The sun's light goes on beyond that: about half of
its power is infrared, of which bricks, tiles and leaves reflect more, and no colour tells how much.

A shader mixes metal, glass and a dull base; here the one that is more than half of it counts. The clear coat over a
dull base (4 % straight on) is left out.

References
----------
B. Burley (2012), Physically based shading at Disney, SIGGRAPH course notes: the α of GGX is the roughness squared.
"""

from .materials import MaterialSpec, recognise_material

WEIGHTS = (0.2126, 0.7152, 0.0722)
DECIMALS = 4  # of an albedo
HALF = 0.5
SMOOTH = 0.05  # α 0.0025: a mirrored sun is blurred by less than its own width of 0.5°
ROUGH = 0.7  # α 0.49: GGX would lose 29 % of an even sky between its facets


def luminance(colour):
    """Luminance of a linear colour with the primaries of Rec. 709."""
    return sum(weight * float(part) for weight, part in zip(WEIGHTS, colour, strict=True))


def albedo_of_colour(colour):
    """Luminance without the rounding errors of colours, which are float32."""
    return round(luminance(colour), DECIMALS)


def shader_material(colour, metallic=0.0, roughness=0.5, transmission=0.0):
    """MaterialSpec of a face with such a shader.

    Parameters
    ----------
    colour : (3,) float, optional
        Linear Rec. 709.
    metallic, roughness, transmission : float, optional
        From 0 to 1, as in Blender's Principled BSDF. Of everything, None is what is not known (as where a texture
        tells it).

    Returns
    -------
    MaterialSpec or None
        None where something that matters is not known.
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
    """Material that a file names, as a MaterialSpec: by its name where it is in the tables, else by its diffuse colour.

    Parameters
    ----------
    name : str
    colour : (3,) float, optional
        Linear Rec. 709; None where it is not known.

    Returns
    -------
    MaterialSpec or None
        None where neither tells.
    """
    word = recognise_material(name)
    if word and word != "mirror":
        return MaterialSpec(material=word)
    return None if colour is None else MaterialSpec(albedo_of_colour(colour), word)
