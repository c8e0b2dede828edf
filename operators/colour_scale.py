"""Which colour a value gets: the stops of the maps, their range and the ticks of the legend."""

from dataclasses import dataclass, field

import numpy as np

from .attributes import CODES, RESULTS, TITLES

# Perceptually uniform maps, sRGB at 17 equal steps from low to high: viridis and inferno by S. van der Walt and
# N. Smith (CC0), cividis by Nuñez, Anderton and Renslow (2018), https://doi.org/10.1371/journal.pone.0199239.
MAPS = {
    "viridis": "440154 48186a 472d7b 424086 3b528b 33638d 2c728e 26828e 21918c 1fa088 28ae80 3fbc73 5ec962 84d44b "
    "addc30 d8e219 fde725",
    "cividis": "00224e 002e6a 1a386f 32436d 434e6c 535a6d 61656f 6f7073 7d7c78 8c8878 9b9476 aba072 bcae6c cdbb63 "
    "dec958 f0d846 fee838",
    "inferno": "000004 0b0724 210c4a 3d0965 57106e 71196e 8a226a a32c61 bc3754 d24644 e45a31 f1731d f98e09 fcac11 "
    "f9cb35 f2ea69 fcffa4",
}

# One colour per code, told apart by colour-blind eyes too: M. Okabe and K. Ito (2008).
CLASS_COLOURS = {
    "kind": {
        "facade": "e69f00",
        "roof": "0072b2",
        "flat": "56b4e9",
        "steep": "cc79a7",
        "downward": "5a5a5a",
        "ground": "b4b4b0",
    },
    "orientation": {"none": "b4b4b0", "north": "0072b2", "east": "009e73", "south": "d55e00", "west": "cc79a7"},
}
MISSING = "8f8f8c"  # faces without this result
GROUND = "dededa"  # generated ground, and the sky of a picture


@dataclass
class ColourScale:
    """How the values of one attribute become colours."""

    attribute: str  # name without prefix
    title: str
    unit: str  # "" where it has none
    low: float
    high: float
    stops: np.ndarray  # (k, 3) sRGB in 0–1, equally spaced from low to high; one per class where there are classes
    ticks: np.ndarray  # (j,) values written beside the bar; empty where there are classes
    classes: list = field(default_factory=list)  # names of the codes 0, 1, …; empty for a continuous scale


def build_scale(attribute, low=0.0, high=1.0, colour_map="viridis"):
    """Build the scale of an attribute.

    Parameters
    ----------
    attribute : str
        A name of `RESULTS`, or "kind" or "orientation", which have a colour for each code.
    low, high : float
        Values at the two ends, in the attribute's unit; not used for codes.
    colour_map : str
        A name of `MAPS`.

    Returns
    -------
    ColourScale
    """
    if attribute in CODES:
        names = sorted(CODES[attribute], key=CODES[attribute].get)
        stops = np.array([srgb_colour(CLASS_COLOURS[attribute][name]) for name in names])
        return ColourScale(attribute, TITLES[attribute], "", -0.5, len(names) - 0.5, stops, np.empty(0), names)
    stops = np.array([srgb_colour(text) for text in MAPS[colour_map].split()])
    step = tick_step(low, high)
    # Ticks are the multiples of the step that lie on the bar.
    ticks = np.arange(np.ceil(low / step - 1e-6), np.floor(high / step + 1e-6) + 1) * step
    return ColourScale(attribute, TITLES[attribute], RESULTS[attribute].unit, low, high, stops, ticks)


def choose_range(values, areas):
    """Round range that holds 96 % of the area: the 2nd and 98th percentile, widened to full ticks.

    Parameters
    ----------
    values : (f,) float
        NaN where missing.
    areas : (f,) float [m²]

    Returns
    -------
    low, high : float
        0 and 1 where no value is finite.
    """
    known = np.isfinite(values)
    if not known.any():
        return 0.0, 1.0
    values, areas = values[known].astype(float), areas[known].astype(float)
    order = np.argsort(values)
    share = np.cumsum(areas[order]) / areas.sum() if areas.sum() > 0 else np.linspace(0, 1, len(values))
    ends = np.minimum(np.searchsorted(share, [0.02, 0.98]), len(values) - 1)
    low, high = values[order][ends]
    step = tick_step(low, high)
    low, high = np.floor(low / step + 1e-6) * step, np.ceil(high / step - 1e-6) * step
    return float(low), float(high if high > low else low + step)


def tick_step(low, high):
    """Distance of ticks: 1, 2 or 5 times a power of ten, so that four to ten of them fit."""
    span = high - low
    if not span > 1e-9 * max(abs(low), abs(high)):
        span = max(abs(high), 1e-3)
    power = 10.0 ** np.floor(np.log10(span / 4))
    return float(power * max(factor for factor in (1, 2, 5) if factor * power <= span / 4 * (1 + 1e-9)))


def format_tick(value, scale):
    """Text of a tick: as many decimals as the distance of the ticks asks for."""
    step = tick_step(scale.low, scale.high)
    decimals = max(0, int(-np.floor(np.log10(step) + 1e-9)))
    return f"{value + 0.0:,.{decimals}f}".replace(",", " ")


def colours_of_values(scale, values):
    """Colours of values: (f,) → (f, 3) sRGB in 0–1; `MISSING` where a value is NaN."""
    place = (np.asarray(values, dtype=float) - scale.low) / (scale.high - scale.low)
    colours = np.tile(srgb_colour(MISSING), (len(place), 1))
    known = np.isfinite(place)
    place = np.clip(place[known], 0, 1)
    if scale.classes:
        colours[known] = scale.stops[np.minimum((place * len(scale.stops)).astype(int), len(scale.stops) - 1)]
        return colours
    position = np.linspace(0, 1, len(scale.stops))
    # Between two stops colours mix in linear light, as the material does it.
    linear = linear_light(scale.stops)
    mixed = np.stack([np.interp(place, position, linear[:, channel]) for channel in range(3)], axis=1)
    colours[known] = srgb_light(mixed)
    return colours


def linear_light(srgb):
    """From sRGB in 0–1 to linear light (IEC 61966-2-1)."""
    srgb = np.asarray(srgb, dtype=float)
    return np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)


def srgb_light(linear):
    """From linear light to sRGB in 0–1 (IEC 61966-2-1)."""
    linear = np.asarray(linear, dtype=float)
    return np.where(linear <= 0.0031308, linear * 12.92, 1.055 * np.maximum(linear, 1e-12) ** (1 / 2.4) - 0.055)


def linear_colour(text):
    """Colour written as six hexadecimal digits (sRGB) → (r, g, b, 1) in linear light, as Blender's nodes want it."""
    return (*linear_light(srgb_colour(text)).tolist(), 1.0)


def srgb_colour(text):
    """Colour written as six hexadecimal digits → (3,) sRGB in 0–1."""
    return np.array([int(text[place : place + 2], 16) / 255 for place in (0, 2, 4)])
