"""The estimators, and presets: points on the curve of error against time (docs/accuracy.md)."""

ESTIMATORS = {
    "gather": "Rays from the surfaces: fast; photons only for mirrors, glossy surfaces and glass",
    "forward": "Photons from sun, sky and far ground for all light: slow, without discretisation error",
}
PRESET_WORDS = {
    "draft": "A first look: a quarter of the rays, half of the days",
    "standard": "The defaults of all options",
    "reference": "Four times the rays, twice the days, patches of 5 m",
}
PRESETS = {
    "draft": {"samples": 64, "shadow_samples": 4, "suns": "days:12"},
    "standard": {},
    "reference": {"samples": 1024, "shadow_samples": 64, "suns": "days:52", "patch_size": 5.0, "max_bounces": 5},
}


def settings_of_preset(preset, **given):
    """Settings that a preset implies; those given beside it win.

    Parameters
    ----------
    preset : str
        A key of PRESETS.
    **given
        Fields of Request.

    Returns
    -------
    dict
        For `Request(**settings)`.
    """
    return {**PRESETS[preset], **given, "preset": preset}
