"""The fields of transfer.nc."""

FORMAT = "CityPV transfer 1"

TEXTS = ("surface_id", "building_id", "thematic", "kind", "orientation")

PER_SURFACE = {  # name -> owner, unit
    "eligible": ("surfaces", "1"),
    "area": ("surfaces", "m2"),
    "surface_tilt": ("surfaces", "degree"),
    "surface_azimuth": ("surfaces", "degree"),
    "covered_share": ("transfer", "1"),
    "sky_view_factor": ("transfer", "1"),
    "far_ground_view_factor": ("transfer", "1"),
    "diffuse_relative": ("transfer", "1"),
    "diffuse_relative_standard_error": ("transfer", "1"),
    "direct_annual_standard_error": ("transfer", "1"),
}

PER_SUN = ("weight", "day", "step")

PER_SURFACE_AND_SUN = ("visible_share", "direct_reflected")
