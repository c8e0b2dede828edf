"""The fields of transfer.nc."""

from .columns import COLUMNS

FORMAT = "CityPV transfer 1"

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
