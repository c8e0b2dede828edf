"""The horizon as a traced source of light, whose unit is the irradiance that it gives to an unshaded wall."""

import numpy as np

from .horizon_band import (
    HEIGHT,
    directions_inwards,
    horizon_directions,
    horizon_of_tilt,
    lies_in_band,
    weight_of_band,
)
from .seen_band import seen_band
from .sky_source import SkySource

HORIZON = SkySource(
    name="horizon",
    title="the horizon",
    unit="that of an unshaded wall",
    skies=("perez",),
    stream=np.uint64(0x4071),
    incidence="horizon",
    unshaded=horizon_of_tilt,
    sample=horizon_directions,
    seen=seen_band,
    contains=lies_in_band,
    radiance=np.pi / (HEIGHT + np.sin(2 * HEIGHT) / 2),
    low=np.pi / (2 * HEIGHT),
    # A beam from azimuth φ and elevation e has the normal irradiance dφ de / (2 HEIGHT cos e).
    sides=np.array([-np.pi * np.log(np.cos(HEIGHT)) / HEIGHT, 0, 1, 1, 1, 1]),
    enter=directions_inwards,
    weigh=weight_of_band,
)
