"""The fields of transfer.nc."""

from .columns import COLUMNS

FORMAT = "CityPV transfer 1"
BARE = "bare"  # group with the state of deciduous trees without leaves

TEXTS = tuple(column.name for column in COLUMNS if column.stored and column.kind == "text")
PER_SURFACE = {  # name -> owner, unit, long name
    column.name: (column.owner, column.unit, column.meaning)
    for column in COLUMNS
    if column.stored and column.kind != "text"
}

ALBEDO, MATERIAL = "albedo", "material"  # per surface; files written before they were kept lack both
TRACED_AS = {  # name -> attributes
    ALBEDO: {
        "units": "1",
        "long_name": "albedo that the surface was traced with; of mirrors, glossy faces, glass and water the most that "
        "they reflect",
    },
    MATERIAL: {"long_name": "material that the surface was traced as; empty where no more than an albedo was given"},
}

PER_SUN = ("weight", "day", "step")

PER_SURFACE_AND_SUN = {  # name -> long name
    "visible_share": "share of the surface that sees the sun",
    "direct_reflected": "reflected irradiance per DNI, without the first reflection of the far ground",
}

ERROR_PARTS = {  # name -> dimensions, long name; files written before they were kept lack them, forward has none
    "diffuse_passed_on": (
        ("surface", "replicate"),
        "deviations of replicates of diffuse light that other surfaces pass on",
    ),
    "direct_passed_on": (("surface", "replicate"), "the same of the annual mean of direct light"),
    "diffuse_discretisation": (("surface",), "diffuse light in excess by the size of patches; 0 where little"),
    "direct_discretisation": (("surface",), "the same of the annual mean of direct light"),
    "covariance": (("surface",), "covariance of the surface's own noise in diffuse and in annual direct light"),
    "direct_points": (("surface",), "variance of the annual mean of direct light from shadow points"),
}

TERRAIN = "terrain_elevation"  # files of runs without distant terrain lack it
TERRAIN_DETAILS = {
    "units": "degree",
    "long_name": "elevation of distant terrain at equally spaced azimuths, clockwise from true north",
}

SOURCE_LIGHT = {  # field of SourceLight -> long name, of each traced source; files of isotropic skies have none
    "view_factor": "light of {title}, per {unit}, without reflections",
    "relative": "light of {title}, per {unit}, reflections included",
    "standard_error": "standard error of {name}_relative",
}

OUTLINES = {  # name -> dimensions, attributes; files written before outlines were kept lack them
    "outline_points": (
        ("corner", "axis"),
        {"units": "m", "long_name": "corners of the surfaces: true east, true north, up from the scene's origin"},
    ),
    "outline_ring_start": (("ring_bound",), {"long_name": "first corner of each ring, and the number of corners"}),
    "outline_surface_start": (("surface_bound",), {"long_name": "first ring of each surface, and the number of rings"}),
}
