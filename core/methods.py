"""Whole methods by name: the settings that each implies."""

METHODS = {
    # Bredemeier et al., CityPV; docs/method_paper.md says what follows from each, and where the program differs.
    "paper": {
        "suns": "typical-days:12",
        "horizon_cut": "neglect",
        "sky": "isotropic",
        "max_bounces": 3,
        "albedo": 0.25,
        "ground_albedo": 0.25,
        "report": "all",
        "module": "SunPower_SPR_300_WHT__2007__E__",
        "mounting": "open-rack",
        "iam": "module",
        "diffuse_iam": False,
        "losses": 0.0,
        "inverter": None,
        "hidden_walls": "count",
        "overhangs": "count",
        "usable": {},
        "effects": {"trees": False},
    },
}


def settings_of_method(method, **given):
    """Settings that a method implies; those given beside it win.

    Parameters
    ----------
    method : str or None
        A key of METHODS.
    **given
        Fields of Request.

    Returns
    -------
    dict
        For `Request(**settings)`.
    """
    return {**METHODS.get(method, {}), **given, "method": method}
