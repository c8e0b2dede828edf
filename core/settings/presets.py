"""Names for sets of settings: the estimators, presets (points on the curve of error against time),
whole methods.
"""

from .system_settings import PAPER_MODULE

ESTIMATORS = {
    "gather": "Rays from the surfaces: fast; photons only for mirrors, glossy surfaces and glass",
    "forward": (
        "Photons from sun, sky and far ground for all light: slow, without discretisation error"
    ),
}
PRESET_WORDS = {
    "draft": "A first look: a quarter of the rays, half of the days",
    "standard": "The defaults of all options",
    "reference": "Four times the rays, twice the days, patches of 5 m",
}
PRESETS = {
    "draft": {"samples": 64, "shadow_samples": 4, "suns": "days:12"},
    "standard": {},
    "reference": {
        "samples": 1024,
        "shadow_samples": 64,
        "suns": "days:52",
        "patch_size": 5.0,
        "max_bounces": 5,
    },
}


METHODS = {
    # Bredemeier et al., CityPV; docs/reference/method_paper.md says what follows from each.
    "paper": {
        "suns": "typical-days:12",
        "horizon_cut": "neglect",
        "sky": "isotropic",
        "max_bounces": 3,
        "albedo": 0.25,
        "ground_albedo": 0.25,
        "report": "all",
        "module": PAPER_MODULE,
        "mounting": "open-rack",
        "iam": "module",
        "diffuse_iam": False,
        "losses": 0.0,
        "inverter": None,
        "hidden_walls": "count",
        "clearance": 0.01,
        "sectors": "paper",
        "overhangs": "count",
        "usable": {},
        "layout": "area",
        "effects": {"trees": False},
    },
}


# Of these groups, settings that mean nothing for a world.
NOT_FOR_WORLDS = ("series", "monthly", "losses", "inverter", "allow_distance", "weather_point")
NOT_FOR_WORLDS += ("least_hours", "leave_out", "layout", "module_size", "storey", "window_band")
NOT_FOR_WORLDS += ("ground_floor", "facades", "strings", "districts", "private")
