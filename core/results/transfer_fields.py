"""The fields of transfer.nc."""

FORMAT = "CityPV transfer 1"

TEXTS = ("surface_id", "building_id", "thematic", "kind", "orientation")

PER_SURFACE = {  # name -> owner, unit, long name
    "eligible": ("surfaces", "1", "facade or roof that modules may stand on"),
    "area": ("surfaces", "m2", "area without holes"),
    "surface_tilt": ("surfaces", "degree", "tilt from the horizontal"),
    "surface_azimuth": ("surfaces", "degree", "azimuth clockwise from true north"),
    "covered_share": ("transfer", "1", "share that lies inside or under buildings"),
    "sky_view_factor": ("transfer", "1", "cosine-weighted free share of the sky"),
    "far_ground_view_factor": ("transfer", "1", "share of the hemisphere that meets open ground beyond the scene"),
    "diffuse_relative": ("transfer", "1", "irradiance per DHI, reflections included"),
    "diffuse_relative_standard_error": ("transfer", "1", "standard error of diffuse_relative"),
    "direct_annual_standard_error": ("transfer", "1", "standard error of the annual mean irradiance per DNI"),
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
