"""Files and tables of weather for the tests."""

from pathlib import Path

import numpy as np
import pandas as pd

ROOT = Path(__file__).parents[2]
ERA5 = ROOT / "examples" / "berlin" / "era5_berlin_2017.nc"
DATA = ROOT / "tests" / "data" / "weather"
BARROW = DATA / "USA_AK_Barrow_TMY3.epw.gz"
PVGIS = DATA / "pvgis_tmy_45.000_8.000_2005_2023.csv.gz"
TMY3 = DATA / "tmy3_744860_new_york_jfk_reduced.csv.gz"
HOUR = pd.Timedelta(hours=1)


def year_of(first=2021, last=None, freq="h"):
    """Time axis of whole calendar years in UTC."""
    return pd.date_range(f"{first}-01-01", f"{(last or first) + 1}-01-01", freq=freq, inclusive="left", tz="UTC")


def plain_table(times):
    """A table of weather with a bright noon at 12 UTC."""
    height = np.maximum(-np.cos(2 * np.pi * (times.hour + 0.5) / 24), 0.0).to_numpy()
    return pd.DataFrame(
        {"ghi": 600.0 * height, "dhi": 200.0 * height, "temp_air": 12.0, "wind_speed": 3.0}, index=times.rename("time")
    )


def write_table(path, table):
    """The table as csv with the UTC offset of its times."""
    table.to_csv(path)
    return path
