"""Files and tables of weather for the tests."""

import gzip
from pathlib import Path

import numpy as np
import pandas as pd
import pvlib
import pytest
import xarray as xr

from citypv.core.settings.errors import InputError
from citypv.core.weather.read_weather import read_weather

ROOT = Path(__file__).parents[2]
ERA5 = ROOT / "examples" / "berlin" / "era5_berlin_2017.nc"
DATA = ROOT / "tests" / "data" / "weather"
BARROW = DATA / "USA_AK_Barrow_TMY3.epw.gz"
CAIRO = DATA / "EGY_Cairo.Intl.Airport.623660_ETMY.epw.gz"
PVGIS = DATA / "pvgis_tmy_45.000_8.000_2005_2023.csv.gz"
PVGIS_EPW = DATA / "pvgis_tmy_45.000_8.000_2005_2023.epw.gz"
TMY3 = DATA / "tmy3_744860_new_york_jfk_reduced.csv.gz"
STOCKHOLM = DATA / "984998_59.33_18.06_2019.csv.gz"
POTSDAM_2018 = DATA / "Germany_Potsdam_2018_DWD.txt.gz"
POTSDAM_2019 = DATA / "Germany_Potsdam_2019_DWD.txt.gz"
HOUR = pd.Timedelta(hours=1)
BERLIN = (52.51, 13.39)


def year_of(first=2021, last=None, freq="h"):
    """Time axis of whole calendar years in UTC."""
    return pd.date_range(
        f"{first}-01-01", f"{(last or first) + 1}-01-01", freq=freq, inclusive="left", tz="UTC"
    )


def plain_table(times, latitude=BERLIN[0], longitude=BERLIN[1]):
    """A table of weather under an even veil of clouds: 600 Wm⁻² from a sun at the zenith, a third
    of it diffuse.
    """
    interval = times[1] - times[0]
    middle = (times + interval / 2).tz_convert("UTC")
    zenith = pvlib.solarposition.get_solarposition(middle, latitude, longitude)[
        "apparent_zenith"
    ].to_numpy()
    height = np.maximum(np.cos(np.radians(zenith)), 0.0)
    columns = {"ghi": 600.0 * height, "dhi": 200.0 * height, "temp_air": 12.0, "wind_speed": 3.0}
    return pd.DataFrame(columns, index=times.rename("time"))


def write_table(path, table):
    """The table as csv with the UTC offset of its times."""
    table.to_csv(path)
    return path


def save_era5(path, change):
    """The demonstration's file, changed, as a new NetCDF file."""
    with xr.open_dataset(ERA5) as dataset:
        change(dataset[["ssrd", "fdir", "t2m", "u10", "v10"]].load()).to_netcdf(path)
    return path


def lines_of(path):
    """Lines of a packed text file."""
    with gzip.open(path, "rt", encoding="utf-8", errors="replace") as file:
        return file.read().splitlines()


def write_lines(path, lines):
    """A text file of these lines."""
    path.write_text("\n".join(lines) + "\n")
    return path


def read_pvlib_epw(path):
    """Table and place of a packed EPW by pvlib, in 2021."""
    with gzip.open(path, "rt", encoding="utf-8", errors="replace") as file:
        return pvlib.iotools.read_epw(file, coerce_year=2021)


def annual_sums(weather):
    """Of ghi, dni, dhi [kWh/m²]."""
    hours = weather.interval / HOUR
    return (weather.data[["ghi", "dni", "dhi"]].sum() * hours / 1000.0).to_numpy()


def direct_horizontal(data):
    """Direct irradiance on the ground [Wm⁻²]."""
    return data["dni"] * np.maximum(np.cos(np.radians(data["apparent_zenith"])), 0)


def refuse(source, *words, place=BERLIN, **settings):
    """Reading must fail in one line that names the file and the words."""
    with pytest.raises(InputError) as caught:
        read_weather(source, *place, **settings)
    message = str(caught.value)
    assert "\n" not in message
    assert str(source) in message
    for word in words:
        assert word in message, message
