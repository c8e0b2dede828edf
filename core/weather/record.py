"""What a weather file says, before anything is checked or the sun is added."""

from dataclasses import dataclass

import pandas as pd


@dataclass
class Record:
    """The values of one file at one place, as they were read."""

    data: (
        pd.DataFrame
    )  # index: UTC start of each interval; of ghi, dhi, dni, temp_air, wind_speed, pressure what is there
    latitude: float  # [°]
    longitude: float  # [°]
    altitude: float  # [m]
    source: str  # the file, for messages
    label: str  # for the user, beside the results
