"""Colour scale of an attribute, and the ticks of its legend."""

from dataclasses import dataclass, field

import numpy as np

from ..core.results.colour_map import (
    DIVERGING,
    MAPS,
    MISSING,
    linear_light,
    mix_stops,
    srgb_colour,
    srgb_light,
    tick_step,
)
from .attributes import CHANGE, CODES, RESULTS, TITLES

# One colour per code, safe for colour-blind viewers: M. Okabe and K. Ito (2008).
CLASS_COLOURS = {
    "kind": {
        "facade": "e69f00",
        "roof": "0072b2",
        "flat": "56b4e9",
        "steep": "cc79a7",
        "downward": "5a5a5a",
        "ground": "b4b4b0",
        "rack": "f0e442",
    },
    "orientation": {"none": "b4b4b0", "north": "0072b2", "east": "009e73", "south": "d55e00", "west": "cc79a7"},
}


@dataclass
class ColourScale:
    """Mapping from values of one attribute to colours."""

    attribute: str  # name without prefix
    title: str
    unit: str  # "" if it has none
    low: float
    high: float
    stops: np.ndarray  # (k, 3) sRGB in 0–1, equally spaced from low to high, or one per class
    ticks: np.ndarray  # (j,) values labelled beside the bar; empty for classes
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
        A name of `MAPS`; differences have a map of their own.

    Returns
    -------
    ColourScale
    """
    if attribute in CODES:
        names = sorted(CODES[attribute], key=CODES[attribute].get)
        stops = np.array([srgb_colour(CLASS_COLOURS[attribute][name]) for name in names])
        return ColourScale(attribute, TITLES[attribute], "", -0.5, len(names) - 0.5, stops, np.empty(0), names)
    chosen = DIVERGING if attribute.startswith(CHANGE) else MAPS[colour_map]
    stops = np.array([srgb_colour(text) for text in chosen.split()])
    step = tick_step(low, high)
    # Ticks are the multiples of the step within the range.
    ticks = np.arange(np.ceil(low / step - 1e-6), np.floor(high / step + 1e-6) + 1) * step
    return ColourScale(attribute, TITLES[attribute], RESULTS[attribute].legend_unit, low, high, stops, ticks)


def format_tick(value, scale):
    """Label of a tick, with the number of decimals that the tick distance needs."""
    step = tick_step(scale.low, scale.high)
    decimals = max(0, int(-np.floor(np.log10(step) + 1e-9)))
    return f"{value + 0.0:,.{decimals}f}".replace(",", " ")


def colours_of_values(scale, values):
    """Colours of values: (f,) → (f, 3) sRGB in 0–1; `MISSING` if a value is NaN."""
    place = (np.asarray(values, dtype=float) - scale.low) / (scale.high - scale.low)
    colours = np.tile(srgb_colour(MISSING), (len(place), 1))
    known = np.isfinite(place)
    place = np.clip(place[known], 0, 1)
    if scale.classes:
        colours[known] = scale.stops[np.minimum((place * len(scale.stops)).astype(int), len(scale.stops) - 1)]
        return colours
    colours[known] = srgb_light(mix_stops(scale.stops, place))
    return colours


def linear_colour(text):
    """Colour written as six hexadecimal digits (sRGB) → (r, g, b, 1) in linear light, as Blender's nodes want it."""
    return (*linear_light(srgb_colour(text)).tolist(), 1.0)
